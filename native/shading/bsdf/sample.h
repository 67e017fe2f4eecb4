// Results of evaluating and sampling a BSDF.
#pragma once

#include "simd/vector.h"

namespace edgegrad::EDGEGRAD_ISA {

struct BsdfValue {
    Vec3 value;  // f |n.w|
    Float pdf;   // solid-angle density of `sample`
};

struct BsdfSample {
    Mask active;
    Vec3 wi;      // unit, away from the surface
    Vec3 weight;  // f |n.w| / pdf
    Float pdf;
    Mask specular;  // of a mirror, a smooth interface or a followed lobe; no other strategy finds such light
    Vec3 half;      // microfacet normal of a mirror, a coat or a followed lobe, in its own frame
    Mask transmitted;  // to the other side of the triangle
    Int ray_kind;      // kDiffuseRay, kGlossyRay or kTransmissionRay
    Int lobe;          // shading/bsdf/closures.h, Lobe
};

EG_INLINE BsdfSample select(Mask m, const BsdfSample& a, const BsdfSample& b) {
    return {select(m, a.active, b.active),
            select(m, a.wi, b.wi),
            select(m, a.weight, b.weight),
            select(m, a.pdf, b.pdf),
            select(m, a.specular, b.specular),
            select(m, a.half, b.half),
            select(m, a.transmitted, b.transmitted),
            select(m, a.ray_kind, b.ray_kind),
            select(m, a.lobe, b.lobe)};
}

}  // namespace edgegrad::EDGEGRAD_ISA
