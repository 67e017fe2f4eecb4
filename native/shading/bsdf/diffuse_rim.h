// The rim of rough diffuse lobes that are seen from below their shading normal.
//
// Fujii's term b t/max(n.v, n.w) (shading/bsdf/oren_nayar.h) leaves f |n.w| = albedo b (v.w)/pi at n.w = 0
// where n.v <= 0, as at outlines of coarse smooth meshes. There the lobe jumps to 0 at the rim
//   g(w) = n.w = 0,
// a great circle about the shading normal, on its half with v.w > 0. As for transmission lobes
// (shading/bsdf/transmission_rim.h), the domain of L = int f |n.w| L(w) dw moves with n, and
//   dL = int dphi f |n.w| L(w) dg.
#pragma once

#include "shading/bsdf/closures.h"

namespace edgegrad::EDGEGRAD_ISA {

EG_INLINE Mask has_diffuse_rim(const Bsdf& f) {
    if (!f.any_lobe[kDiffuseLobe] || !f.any_oren_nayar) return splat(0);
    return f.active & (f.cosine <= 0.0f) & (f.oren_nayar.b > 0.0f) & (largest_component(f.diffuse) > 0.0f);
}

// Samples a direction on the rim with the density cos(phi)/2, as v.w is proportional to cos(phi).
EG_INLINE RimSample sample_diffuse_rim(const Bsdf& f, Float u) {
    const Vec3 along = f.wo - f.normal * f.cosine;
    const Float length = sqrt(dot(along, along));
    const Vec3 towards = along * (1.0f / max(length, 1e-20f));
    const Float sine = 2.0f * u - 1.0f, cosine = sqrt(max(1.0f - sine * sine, 0.0f));
    return {has_diffuse_rim(f) & (length > 1e-6f) & (cosine > 0.0f),
            towards * cosine + cross(f.normal, towards) * sine, 0.5f * cosine};
}

// f |n.w| at the rim.
EG_INLINE Vec3 diffuse_rim_value(const Bsdf& f, Vec3 w) {
    return f.diffuse * (f.oren_nayar.b * max(dot(f.wo, w), 0.0f) * 0.318309886f);
}

// f |n.w| g for a direction on the rim. Only g has a derivative; the value is 0.
EG_INLINE Vec3 diffuse_rim_change(const Bsdf& f, Vec3 w) {
    const Float g = dot(f.normal, w);
    return detach(diffuse_rim_value(f, w)) * (g - detach(g));
}

}  // namespace edgegrad::EDGEGRAD_ISA
