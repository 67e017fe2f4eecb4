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
    Vec3 half;      // microfacet normal of a followed lobe, in its own frame
    Mask transmitted;  // to the other side of the triangle
    Int ray_kind;      // kDiffuseRay, kGlossyRay or kTransmissionRay
    Int lobe;          // shading/bsdf/closures.h, Lobe
};

}  // namespace edgegrad::EDGEGRAD_ISA
