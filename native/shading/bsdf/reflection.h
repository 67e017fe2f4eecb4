// A rough or perfect mirror: f |cos| = F(h.wo) D / (4 |n.wo| (1 + lambda(wo) + lambda(wi))). F is the sum of
// a metal's, a dielectric's and a constant reflectance, each with its weight.
#pragma once

#include "shading/bsdf/distributions/microfacet.h"
#include "shading/bsdf/thin_film.h"

namespace edgegrad::EDGEGRAD_ISA {

struct Reflection {
    Microfacets facets;
    Vec3 constant;            // weight
    Vec3 metal, metal_f0, b;  // weight, F82-tint
    Vec3 dielectric, f0;      // weight, reflectance at normal incidence
    Float eta;                // of the dielectric, whose Fresnel reflectance is mapped to [f0, 1]
    Film film;                // on metal and dielectric
    bool any_metal, any_dielectric;
    Mask separable;  // masking is the product of both directions' masking
};

EG_INLINE Reflection no_reflection() {
    Reflection r;
    r.constant = r.metal = r.metal_f0 = r.b = r.dielectric = r.f0 = zero3();
    r.eta = splat(1.5f);
    r.film = no_film();
    r.any_metal = r.any_dielectric = false;
    r.separable = splat(0);
    return r;
}

// Fresnel reflectance of a dielectric, mapped so that it is f0 at normal incidence.
EG_INLINE Vec3 mapped_fresnel(Float reflectance, Float eta, Vec3 f0) {
    return mix(f0, white(), fresnel_share(reflectance, f0_of_ior(eta)));
}

EG_INLINE Vec3 reflectance(const Reflection& r, Float cosine) {
    Vec3 f = r.constant;
    if (r.any_metal) {
        Vec3 metal = f82(cosine, r.metal_f0, r.b);
        if (r.film.any) metal = select(r.film.there, film_on_metal(r.film, cosine, r.metal_f0, r.b), metal);
        f = f + r.metal * metal;
    }
    if (r.any_dielectric) {
        Vec3 glossy = mapped_fresnel(dielectric(cosine, r.eta).reflectance, r.eta, r.f0);
        if (r.film.any) glossy = select(r.film.there, film_fresnel(r.film, cosine, r.eta, r.f0), glossy);
        f = f + r.dielectric * glossy;
    }
    return f;
}

struct Scattered {
    Vec3 value;  // f |cos|
    Float pdf;
};

template <bool kOthers>
EG_INLINE Scattered rough_reflection(const Reflection& r, Vec3 view, Vec3 w, Vec3 h, Float cosine) {
    const Float density = evaluated_density<kOthers>(r.facets, (view.z > 0.0f) & (w.z > 0.0f), h);
    const Float masking = smith_lambda<kOthers>(r.facets, w);
    Float both = 1.0f + r.facets.masking + masking;
    if (any(r.separable)) both = both + select(r.separable, r.facets.masking * masking, 0.0f);
    Scattered s = {reflectance(r, cosine) * (density / (4.0f * max(view.z, 1e-20f) * both)),
                   score_pdf(r.facets, view, r.facets.bound, h, reflection_pdf(r.facets, view, density))};
    if constexpr (kOthers) {
        const Float phong = density / (4.0f * max(cosine, 1e-6f));
        s.value =
            select(r.facets.phong, reflectance(r, cosine) * (phong * phong_masking(view.z, w.z)), s.value);
        s.pdf = select(r.facets.phong, detach(phong), s.pdf);
    }
    return s;
}

EG_OUTLINE Scattered reflection_of_others(const Reflection& r, Vec3 view, Vec3 w, Vec3 h, Float cosine) {
    return rough_reflection<true>(r, view, w, h, cosine);
}

// Evaluates directions above the surface, in the local frame; 0 for perfect mirrors, and for followed ones
// without tails.
EG_INLINE Scattered evaluate_reflection(const Reflection& r, Vec3 view, Vec3 w, Vec3 h, Float cosine) {
    if (r.facets.others) return reflection_of_others(r, view, w, h, cosine);
    return rough_reflection<false>(r, view, w, h, cosine);
}

// Samples the microfacet normal.
EG_INLINE Vec3 sample_reflection(const Reflection& r, Vec3 view, Float u, Float v) {
    const Vec3 h = sample_normal(r.facets, view, r.facets.bound, u, v);
    return select(is_smooth(r.facets), Vec3{splat(0.0f), splat(0.0f), splat(1.0f)}, h);
}

}  // namespace edgegrad::EDGEGRAD_ISA
