// The GGX distribution of microfacet normals (Trowbridge and Reitz 1975, Walter et al. 2007) with
// height-correlated Smith masking (Heitz 2014). Visible normals are sampled after Dupuy and Benyoub 2023; for
// reflection, most directions below the surface are excluded (Eto and Tokuyoshi 2023). Vectors are in the
// local frame, whose z is the shading normal.
//
// Lanes may have another distribution: Beckmann's (shading/bsdf/distributions/beckmann.h), or the half
// vectors of Phong lobes (shading/bsdf/distributions/phong_lobe.h). Functions of normals are templates:
// kOthers is false for packets of GGX alone, which so pay nothing for the others.
#pragma once

#include "shading/bsdf/distributions/beckmann.h"
#include "shading/bsdf/distributions/phong_lobe.h"
#include "shading/bsdf/distributions/tail.h"
#include "shading/bsdf/score_density.h"
#include "simd/vector.h"

namespace edgegrad::EDGEGRAD_ISA {

// Below this product of alphas a surface is a perfect mirror (the limit of Cycles).
constexpr float kSmoothAlpha2 = 2e-10f;

// A rough surface seen from `view`.
struct Microfacets {
    Float ax, ay;
    Float stretched;      // |(ax x, ay y, z)| of the view; z + stretched is twice the projected area it sees
    Float masking;        // Smith's lambda of the view
    Float bound;          // of the sampled range of reflections
    Mask by_score;        // sampled for the derivative by roughness (shading/bsdf/score_density.h)
    Mask followed;        // scatters at a fixed microfacet normal (shading/bsdf/followed_lobes.h)
    Float tail;           // of followed lanes: of reflections, what emitter samples find (tail.h); 0: nothing
    bool others = false;  // whether any lane is not GGX
    Mask beckmann, phong;
};

EG_INLINE Float ggx_lambda(const Microfacets& g, Vec3 w) {
    const Float x = g.ax * w.x, y = g.ay * w.y;
    return 0.5f * (sqrt(1.0f + (x * x + y * y) / max(w.z * w.z, 1e-20f)) - 1.0f);
}

EG_INLINE Microfacets make_facets(Float ax, Float ay, Vec3 view) {
    Microfacets g;
    g.ax = ax, g.ay = ay;
    const Float x = ax * view.x, y = ay * view.y;
    g.stretched = sqrt(x * x + y * y + view.z * view.z);
    g.masking = ggx_lambda(g, view);
    const Vec3 v = detach(view);
    const Float a = detach(min(ax, ay)), a2 = a * a;
    const Float s = 1.0f + sqrt(v.x * v.x + v.y * v.y), s2 = s * s;
    g.bound = (1.0f - a2) * s2 / (s2 + a2 * v.z * v.z);
    g.by_score = g.followed = splat(0);
    g.tail = splat(0.0f);
    g.others = false;
    g.beckmann = g.phong = splat(0);
    return g;
}

// Replaces the distribution in the lanes of the two masks.
EG_OUTLINE void set_other_distribution(Microfacets& g, Mask beckmann, Mask phong, Vec3 view) {
    g.others = true;
    g.beckmann = beckmann, g.phong = phong;
    g.masking = select(beckmann, beckmann_lambda(g.ax, g.ay, view), g.masking);
    g.stretched = select(beckmann, beckmann_stretched(g.ax, g.ay, view), g.stretched);
    g.bound = select(beckmann, splat(1.0f), g.bound);
    const Mask smooth = phong & (max(g.ax, g.ay) <= kLeastPhongAlpha);
    const auto limited = [&](Float a) {
        return select(smooth, splat(0.0f), select(phong, max(a, kLeastPhongAlpha), a));
    };
    g.ax = limited(g.ax), g.ay = limited(g.ay);
}

EG_INLINE Mask is_smooth(const Microfacets& g) { return g.ax * g.ay <= kSmoothAlpha2; }
EG_INLINE Float widest_alpha(const Microfacets& g) { return max(g.ax, g.ay); }
// Lanes whose scattered ray is a function of the view. Only such rays find light there.
EG_INLINE Mask is_perfect(const Microfacets& g) { return is_smooth(g) | g.followed; }

// Density of normals. It uses sines rather than 1 - cos^2, which is inaccurate on nearly smooth surfaces.
EG_INLINE Float ggx_density(const Microfacets& g, Vec3 h) {
    const Float area = max(g.ax * g.ay, 1e-20f);
    const Float x = h.x / max(g.ax, 1e-10f), y = h.y / max(g.ay, 1e-10f);
    const Float r = x * x + y * y + h.z * h.z;
    return 0.318309886f / (area * r * r);
}

// Smith's lambda of a direction, and the density of normals (of half vectors for Phong lobes).
template <bool kOthers>
EG_INLINE Float smith_lambda(const Microfacets& g, Vec3 w) {
    const Float lambda = ggx_lambda(g, w);
    if constexpr (kOthers) return select(g.beckmann, beckmann_lambda(g.ax, g.ay, w), lambda);
    return lambda;
}
template <bool kOthers>
EG_INLINE Float normal_density(const Microfacets& g, Vec3 h) {
    Float density = ggx_density(g, h);
    if constexpr (kOthers) {
        if (any(g.beckmann)) density = select(g.beckmann, beckmann_density(g.ax, g.ay, h), density);
        if (any(g.phong)) density = select(g.phong, phong_density(g.ax, g.ay, h), density);
    }
    return density;
}

EG_OUTLINE Float score_places(const Microfacets& g, Float u) { return select(g.by_score, score_place(u), u); }

// The density of the normals of reflections that are evaluated: 0 for perfect mirrors, and for followed ones
// that of their tails.
template <bool kOthers>
EG_INLINE Float evaluated_density(const Microfacets& g, Mask active, Vec3 h) {
    const Mask tails = g.followed & (g.tail > 0.0f), rough = active & ~is_smooth(g);
    const Float density = select(rough & (~g.followed | tails), normal_density<kOthers>(g, h), 0.0f);
    return any(tails) ? select(tails, density * share_of_emitter_samples(h, g.tail), density) : density;
}

// Samples a visible GGX normal. With `bound` 1 it may be any; with g.bound most normals that reflect below
// the surface are excluded.
EG_INLINE Vec3 sample_ggx(const Microfacets& g, Vec3 view, Float bound, Float u, Float v) {
    if (any(g.by_score)) u = score_places(g, u);
    const Float scale = 1.0f / max(g.stretched, 1e-20f);
    const Vec3 stretched = {g.ax * view.x * scale, g.ay * view.y * scale, view.z * scale};
    const Float low = bound * stretched.z;
    const Float z = (1.0f - u) * (1.0f + low) - low;
    const Float r = sqrt(max(1.0f - z * z, 0.0f));
    Float s, c;
    sincos_turn(v, s, c);
    const Vec3 h = {g.ax * (r * c + stretched.x), g.ay * (r * s + stretched.y), max(z + stretched.z, 0.0f)};
    const Float length = sqrt(dot(h, h));
    return select(length > 1e-20f, h * (1.0f / max(length, 1e-20f)),
                  Vec3{splat(0.0f), splat(0.0f), splat(1.0f)});
}

// Samples a normal of each lane's distribution.
EG_INLINE Vec3 sample_normal(const Microfacets& g, Vec3 view, Float bound, Float u, Float v) {
    Vec3 h = sample_ggx(g, view, bound, u, v);
    if (!g.others) return h;
    if (any(g.beckmann)) h = select(g.beckmann, sample_beckmann(g.ax, g.ay, view, u, v), h);
    if (any(g.phong)) h = select(g.phong, sample_phong(g.ax, g.ay, u, v), h);
    return h;
}

// Density of reflections at the normals of `sample_normal`: D / (2 (bound z + stretched)).
EG_INLINE Float reflection_pdf(const Microfacets& g, Vec3 view, Float density) {
    return detach(density) / (2.0f * max(g.bound * detach(view.z) + detach(g.stretched), 1e-20f));
}

// Density of the random number u that `sample_normal` maps to h. u is the height of the point on the sphere
// to which the stretched h reflects the view. A separate function, so that the compiler cannot merge it with
// the picture's computation and change the picture's bits.
EG_OUTLINE Float score_factor(const Microfacets& g, Vec3 view, Float bound, Vec3 h) {
    const Vec3 n = detach(h), v = detach(view);
    const Float x = n.x / max(detach(g.ax), 1e-10f), y = n.y / max(detach(g.ay), 1e-10f);
    const Float scale = 1.0f / max(detach(g.stretched), 1e-20f), low = bound * v.z * scale;
    const Float z = (2.0f * dot(n, v) * n.z / max(x * x + y * y + n.z * n.z, 1e-20f) - v.z) * scale;
    return select(g.by_score, score_density(1.0f - (z + low) / (1.0f + low)), 1.0f);
}

// The density of h from `sample_normal`, with the factor of score sampling.
EG_INLINE Float score_pdf(const Microfacets& g, Vec3 view, Float bound, Vec3 h, Float pdf) {
    return any(g.by_score) ? pdf * score_factor(g, view, bound, h) : pdf;
}

}  // namespace edgegrad::EDGEGRAD_ISA
