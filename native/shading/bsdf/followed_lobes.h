// Followed lobes: narrow lobes that are differentiated at a fixed microfacet normal h, like perfect mirrors
// and interfaces with a random normal.
//
// At a fixed direction or in material form, a rough lobe changes by d log f ~ 1/alpha. With h fixed in the
// surface's own frame, the ray is that of a perfect mirror or interface with the normal h, and it moves with
// view and frame. By h, the scattered light is
//   int F(h.v) D(h) G2(v, w) (h.v)/v.z L(w(v, h)) dh
// for reflection and refraction with the ray w(v, h). Nothing is divided by alpha (derivations, Q). Light and
// density are both expressed by the measure D dh, because D itself is unbounded. For Phong lobes
// (shading/bsdf/distributions/phong_lobe.h), whose half vectors have the density p,
//   int F(h.v) p(h) w.z / max(v.z, w.z) L(w(v, h)) dh.
#pragma once

#include "shading/bsdf/closures.h"

namespace edgegrad::EDGEGRAD_ISA {

// Width of a lobe's directions by its alpha, relative to reflection: refraction at glass spreads rays less.
constexpr float width_by_alpha(int lobe) { return lobe == kInterfaceLobe ? 0.2f : 1.0f; }

// Calls visit(lobe, facets) for the lobes that may be followed.
template <typename F, typename Visit>
EG_INLINE void for_each_facets(F& f, const Visit& visit) {
    if (f.any_lobe[kMirrorLobe]) visit(kMirrorLobe, f.mirror.facets);
    if (f.any_lobe[kCoatLobe]) visit(kCoatLobe, f.coat.facets);
    if (f.any_lobe[kInterfaceLobe]) visit(kInterfaceLobe, f.glass.facets);
}

// Selects the lobes that are followed. Returns their bits (1 << Lobe). Refraction closures are excluded: they
// stop transmitting at total reflection, which is a discontinuity at fixed h.
EG_INLINE Int follow_lobes(Bsdf& f, Mask m, const Followed& limits) {
    Int bits = splat(0);
    for_each_facets(f, [&](Lobe k, Microfacets& g) EG_INLINE_LAMBDA {
        const Mask may = k == kMirrorLobe      ? ~f.mirror.separable
                         : k == kInterfaceLobe ? ~f.glass.refracts_only & splat(limits.interfaces ? -1 : 0)
                                               : splat(-1);
        g.followed = m & may & (f.probability[k] > 0.0f) & ~is_smooth(g) & (widest_alpha(g) <= limits.widest);
        g.tail = tail_of_lobe(limits.tail, widest_alpha(g));
        bits = bits | (g.followed & (1 << k));
    });
    return bits;
}

// The bits of the mirrors and coats up to this alpha, which may throw light on other surfaces
// (path/lights/thrown_light.h).
EG_INLINE Int throwing_lobes(Bsdf f, Mask m, Float widest) {
    return follow_lobes(f, m, Followed(widest).reflections()) & ~(1 << kInterfaceLobe);
}

// Makes the lobes in `bits` followed.
EG_INLINE void follow_lobes(Bsdf& f, Int bits) {
    for_each_facets(f, [&](Lobe k, Microfacets& g) EG_INLINE_LAMBDA { g.followed = (bits & (1 << k)) != 0; });
}

// Keeps of the followed lobes those within the limits.
EG_INLINE void follow_up_to(Bsdf& f, const Followed& limits) {
    for_each_facets(f, [&](Lobe, Microfacets& g) EG_INLINE_LAMBDA {
        g.followed &= widest_alpha(g) <= limits.widest;
        g.tail = tail_of_lobe(limits.tail, widest_alpha(g));
    });
}

// Lanes with a followed lobe.
EG_INLINE Mask has_followed_lobes(const Bsdf& f) {
    Mask some = splat(0);
    for_each_facets(f, [&](Lobe, const Microfacets& g) EG_INLINE_LAMBDA { some |= g.followed; });
    return some;
}

// The lobe that scattered rays, with the microfacet normal h in its frame if it is a followed one.
EG_INLINE RayLobe lobe_of_rays(const Bsdf& f, Int lobe, Mask transmitted, Vec3 h) {
    RayLobe out;
    for_each_facets(f, [&](Lobe k, const Microfacets& g) EG_INLINE_LAMBDA {
        Mask follows = (lobe == splat(k)) & g.followed;
        if (k == kInterfaceLobe) follows &= ~(transmitted & refracts_smoothly(f.glass));
        out.alpha = select(follows, widest_alpha(g), out.alpha);
    });
    const Mask has_tail = (out.alpha > 0.0f) & ~transmitted;
    out.slope2 = select(has_tail, (h.x * h.x + h.y * h.y) / max(h.z * h.z, 1e-20f), 0.0f);
    return out;
}

// The light of h by the measure D(h) dh, without the Fresnel factor. `transmitted` says to which side it
// goes.
template <bool kOthers>
EG_INLINE Float followed_share(const Microfacets& g, Vec3 view, Vec3 w, Mask transmitted, Float cosine) {
    const Mask counts = (view.z > 0.0f) & (cosine > 0.0f) & select(transmitted, w.z < 0.0f, w.z > 0.0f);
    const Float smith = cosine / (max(view.z, 1e-20f) * (1.0f + g.masking + smith_lambda<kOthers>(g, w)));
    if constexpr (kOthers) return select(counts, select(g.phong, phong_masking(view.z, w.z), smith), 0.0f);
    return select(counts, smith, 0.0f);
}

EG_INLINE Float followed_light(const Microfacets& g, Vec3 view, Vec3 w, Mask transmitted, Float cosine) {
    return g.others ? followed_share<true>(g, view, w, transmitted, cosine)
                    : followed_share<false>(g, view, w, transmitted, cosine);
}

// The density of `sample_normal` by the measure D(h) dh.
EG_INLINE Float followed_density(const Microfacets& g, Vec3 view, Float bound, Float cosine) {
    const Float visible =
        2.0f * detach(cosine) / max(detach(bound) * detach(view.z) + detach(g.stretched), 1e-20f);
    return g.others ? select(g.phong, splat(1.0f), visible) : visible;
}

// D(h) divided by its own value: 1, with the derivative by the lobe's width.
EG_INLINE Float relative_density(const Microfacets& g, Vec3 h) {
    const Float d = g.others ? normal_density<true>(g, h) : normal_density<false>(g, h);
    return d * (1.0f / max(detach(d), 1e-37f));
}

}  // namespace edgegrad::EDGEGRAD_ISA
