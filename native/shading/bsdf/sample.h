// What evaluating and sampling a BSDF give.
#pragma once

#include "simd/vector.h"

namespace edgegrad::EDGEGRAD_ISA {

struct BsdfValue {
    Vec3 value;  // f |n.w|
    Float pdf;   // solid-angle density with which `sample` finds w
};

struct BsdfSample {
    Mask active;
    Vec3 wi;      // unit, away from the surface
    Vec3 weight;  // f |n.w| / pdf
    Float pdf;
    Mask specular;     // of a mirror, a smooth interface or a followed lobe: no other strategy finds it
    Mask followed;     // of a followed lobe (shading/bsdf/followed_lobes.h), by the microfacet normal
    Vec3 half;         // `half`, in the lobe's own frame
    Mask transmitted;  // to the other side of the triangle
    Int ray_kind;      // kDiffuseRay, kGlossyRay or kTransmissionRay
    Int lobe;          // shading/bsdf/closures.h, Lobe
};

}  // namespace edgegrad::EDGEGRAD_ISA
