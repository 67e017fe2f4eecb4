// Narrow lobes that are followed: mirrors and interfaces whose microfacet normal h is random, and held.
//
// A rough lobe that is differentiated at a direction that stays, or that rides on what it shows, changes by
// d log f ~ 1/alpha. With h held in the surface's own frame instead, the ray that it makes of the view is a
// perfect mirror's or interface's with another normal, and moves with view and frame; by h the light is
//   int F(h.v) D(h) G2(v, w) (h.v)/v.z L(w(v, h)) dh
// of reflection and of refraction, w(v, h) the ray: nothing is divided by alpha (derivations, Q). Where D is
// alike of two views, both are given here by D dh, for D's size has no bound.
#pragma once

#include "shading/bsdf/closures.h"

namespace edgegrad::EDGEGRAD_ISA {

// Follows lobes of lanes of the mask up to an alpha of `widest`; their bits (1 << Lobe). Left out are shaders
// that stop to transmit where they would reflect totally: for one h that is a jump.
EG_INLINE Int follow_lobes(Bsdf& f, Mask m, float widest) {
    Int bits = splat(0);
    const auto follow = [&](Lobe k, Ggx& g, Mask may) {
        if (!f.any_lobe[k]) return;
        g.followed = m & may & (f.probability[k] > 0.0f) & ~is_smooth(g) & (max(g.ax, g.ay) <= widest);
        bits = bits | (g.followed & (1 << k));
    };
    follow(kMirrorLobe, f.mirror.ggx, ~f.mirror.separable);
    follow(kCoatLobe, f.coat.ggx, splat(-1));
    follow(kInterfaceLobe, f.glass.ggx, ~f.glass.refracts_only);
    return bits;
}

// Follows the lobes that `bits` names.
EG_INLINE void follow_lobes(Bsdf& f, Int bits) {
    const auto set = [&](Lobe k, Ggx& g) {
        if (f.any_lobe[k]) g.followed = (bits & (1 << k)) != 0;
    };
    set(kMirrorLobe, f.mirror.ggx), set(kCoatLobe, f.coat.ggx), set(kInterfaceLobe, f.glass.ggx);
}

// Follows none of lanes of the mask.
EG_INLINE void follow_none(Bsdf& f, Mask m) {
    if (f.any_lobe[kMirrorLobe]) f.mirror.ggx.followed &= ~m;
    if (f.any_lobe[kCoatLobe]) f.coat.ggx.followed &= ~m;
    if (f.any_lobe[kInterfaceLobe]) f.glass.ggx.followed &= ~m;
}

// F aside, the light of h by D(h) dh, which goes to the side of `transmitted`.
EG_INLINE Float followed_light(const Ggx& g, Vec3 view, Vec3 w, Mask transmitted, Float cosine) {
    const Mask counts = (view.z > 0.0f) & (cosine > 0.0f) & select(transmitted, w.z < 0.0f, w.z > 0.0f);
    return select(counts, cosine / (max(view.z, 1e-20f) * (1.0f + g.masking + ggx_lambda(g, w))), 0.0f);
}

// The density of `sample_normal` by D(h) dh.
EG_INLINE Float followed_density(const Ggx& g, Vec3 view, Float bound, Float cosine) {
    return 2.0f * detach(cosine) / max(detach(bound) * detach(view.z) + detach(g.stretched), 1e-20f);
}

// D(h) by its own value: 1, which changes with the lobe's width.
EG_INLINE Float relative_density(const Ggx& g, Vec3 h) {
    const Float d = ggx_density(g, h);
    return d * (1.0f / max(detach(d), 1e-37f));
}

}  // namespace edgegrad::EDGEGRAD_ISA
