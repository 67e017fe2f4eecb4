// A rough or smooth interface of two media (Walter et al. 2007): reflection and refraction, or refraction
// alone. As in Cycles, radiance is not scaled by the squared index.
#pragma once

#include "shading/bsdf/reflection.h"

namespace edgegrad::EDGEGRAD_ISA {

struct Interface {
    Microfacets facets;
    Vec3 reflection, transmission;  // weights, tints included
    Vec3 f0;
    Float eta;  // index of the other side divided by that of the viewer's side
    Film film;
    Mask refracts_only;  // transmits all light that is not totally reflected
    bool by_slope;       // sampled for derivatives (reflect_by_slope)
};

EG_INLINE Interface no_interface() {
    Interface g;
    g.reflection = g.transmission = g.f0 = zero3();
    g.eta = splat(1.5f);
    g.film = no_film();
    g.refracts_only = splat(0);
    g.by_slope = false;
    return g;
}

// Light between equal indices continues straight.
EG_INLINE Mask bends_nothing(Float eta) { return abs(eta - 1.0f) < 1e-4f; }
EG_INLINE Mask refracts_smoothly(const Interface& g) { return is_smooth(g.facets) | bends_nothing(g.eta); }
EG_INLINE Mask refracts_perfectly(const Interface& g) { return refracts_smoothly(g) | g.facets.followed; }

struct Split {
    Vec3 reflected, transmitted;
    Float cosine;  // of the refracted direction with the microfacet, > 0
    Float reflect_probability;
};

EG_INLINE Split split_light(const Interface& g, Float cosine) {
    const Dielectric d = dielectric(cosine, g.eta);
    Vec3 f = mapped_fresnel(d.reflectance, g.eta, g.f0);
    if (g.film.any) f = select(g.film.there, saturate(film_fresnel(g.film, cosine, g.eta, g.f0)), f);
    const Mask total = d.reflectance >= 1.0f;
    Split s;
    s.reflected = g.reflection * select(g.refracts_only, zero3(), f);
    s.transmitted = g.transmission * select(g.refracts_only, white(), white() - f);
    s.transmitted = select(total, zero3(), s.transmitted);
    s.cosine = d.cosine;
    const Float r = average(detach(s.reflected)), t = average(detach(s.transmitted));
    s.reflect_probability = select(r + t > 0.0f, r / max(r + t, 1e-30f), 0.0f);
    return s;
}

template <bool kOthers>
EG_INLINE Scattered rough_interface_reflection(const Interface& g, Vec3 view, Vec3 w, Vec3 h, Float cosine) {
    const Split s = split_light(g, cosine);
    const Float density = evaluated_density<kOthers>(g.facets, (view.z > 0.0f) & (w.z > 0.0f), h);
    const Float both = 1.0f + g.facets.masking + smith_lambda<kOthers>(g.facets, w);
    return {s.reflected * (density / (4.0f * max(view.z, 1e-20f) * both)),
            score_pdf(g.facets, view, splat(1.0f), h,
                      s.reflect_probability * detach(density) /
                          (2.0f * max(detach(view.z) + detach(g.facets.stretched), 1e-20f)))};
}

EG_OUTLINE Scattered interface_reflection_of_others(const Interface& g, Vec3 view, Vec3 w, Vec3 h,
                                                    Float cosine) {
    return rough_interface_reflection<true>(g, view, w, h, cosine);
}

EG_INLINE Scattered evaluate_interface_reflection(const Interface& g, Vec3 view, Vec3 w, Vec3 h,
                                                  Float cosine) {
    if (g.facets.others) return interface_reflection_of_others(g, view, w, h, cosine);
    return rough_interface_reflection<false>(g, view, w, h, cosine);
}

template <bool kOnRim, bool kOthers>
EG_INLINE Scattered rough_refraction(const Interface& g, Vec3 view, Vec3 w) {
    const Vec3 sum = view + w * g.eta;
    // The normal of refracting microfacets points from the denser medium to the other one. The sum is at
    // least |eta - 1| long, which is above 1e-4 where light refracts roughly. In the other lanes the square
    // of the inverse must stay finite.
    const Float inverse = select(g.eta > 1.0f, splat(-1.0f), 1.0f) / max(sqrt(dot(sum, sum)), 1e-6f);
    const Vec3 h = sum * inverse;
    const Float ho = dot(h, view), hi = dot(h, w);
    const Mask inside = kOnRim ? splat(-1) : h.z > 0.0f;
    const Mask rough =
        ~refracts_perfectly(g) & (view.z > 0.0f) & (w.z < 0.0f) & inside & (ho > 0.0f) & (hi < 0.0f);
    // There is no early return for packets without refracting lanes: GCC 12 would always take it for one-lane
    // packets.
    const Split s = split_light(g, ho);
    const Float jacobian = g.eta * g.eta * inverse * inverse * abs(hi);
    const Float density = select(rough, normal_density<kOthers>(g.facets, h), 0.0f) * jacobian * ho;
    const Float both = 1.0f + g.facets.masking + smith_lambda<kOthers>(g.facets, w);
    // The density of visible normals is 2 D (h.view) / (view.z + stretched).
    return {s.transmitted * (density / (max(view.z, 1e-20f) * both)),
            score_pdf(g.facets, view, splat(1.0f), h,
                      (1.0f - s.reflect_probability) * 2.0f * detach(density) /
                          max(detach(view.z) + detach(g.facets.stretched), 1e-20f))};
}

EG_OUTLINE Scattered refraction_of_others(const Interface& g, Vec3 view, Vec3 w) {
    return rough_refraction<false, true>(g, view, w);
}

// `kOnRim`: w is on the lobe's rim (shading/bsdf/transmission_rim.h); returns the limit from inside the lobe.
template <bool kOnRim = false>
EG_INLINE Scattered evaluate_refraction(const Interface& g, Vec3 view, Vec3 w) {
    if constexpr (!kOnRim)
        if (g.facets.others) return refraction_of_others(g, view, w);
    return rough_refraction<kOnRim, false>(g, view, w);
}

struct InterfaceSample {
    Vec3 w;
    Mask found;  // false: the microfacet chosen for refraction reflects totally
    Mask refracted, perfect;
    Vec3 value;         // of perfect and followed ones: weight divided by the probability of the choice
    Vec3 h;             // microfacet normal
    Float probability;  // of the choice between reflection and refraction
};

// Probability of reflection at a smooth interface, for derivatives. The slope F' of the reflectance enters
// the derivative of both reflection and refraction. If the choice were proportional to their shares, as for
// pictures, the second moment F'^2 / T of refraction would be unbounded towards the critical angle, where T ~
// g and F' ~ 1/g (derivations, N). kBySlope trades this variance for that of the light itself. kMost bounds
// the probability: without it, light that is reflected repeatedly near that angle, as within a ball, would
// get twice the weight at each reflection.
EG_INLINE Float reflect_by_slope(Float picture, Float eta, Float cosine, Float refracted) {
    constexpr float kBySlope = 0.2f, kMost = 0.25f, kLeast = 1e-4f;
    const Float g = max(eta * refracted, kLeast);
    const Float slope = min(kBySlope * abs(reflectance_fall(abs(cosine), eta, g, 1.0f / g)), splat(kMost));
    const Mask both = (picture > 0.0f) & (picture < 1.0f);
    return select(both, (picture + slope) / (1.0f + 2.0f * slope), picture);
}

EG_INLINE InterfaceSample sample_interface(const Interface& g, Vec3 view, Float choice, Float u, Float v) {
    const Vec3 z = {splat(0.0f), splat(0.0f), splat(1.0f)};
    const Mask smooth = is_smooth(g.facets);
    const Vec3 h = select(smooth, z, sample_normal(g.facets, view, splat(1.0f), u, v));
    const Float cosine = dot(h, view);
    Split s = split_light(g, cosine);
    if (g.by_slope)
        s.reflect_probability =
            select(is_perfect(g.facets), reflect_by_slope(s.reflect_probability, g.eta, cosine, s.cosine),
                   s.reflect_probability);
    InterfaceSample r;
    r.found = average(s.reflected + s.transmitted) > 0.0f;
    r.refracted = choice >= s.reflect_probability;
    r.h = h;
    r.perfect = select(r.refracted, refracts_perfectly(g), is_perfect(g.facets));
    r.probability = select(r.refracted, 1.0f - s.reflect_probability, s.reflect_probability);
    // A division rounds each sample by itself. A factor 1/eta, whose rounding is that of all samples, would
    // shift them against the lobe (sample() in shading/bsdf/bsdf.h).
    const Vec3 bent = h * (cosine - g.eta * s.cosine) - view;
    const Vec3 through = {bent.x / g.eta, bent.y / g.eta, bent.z / g.eta};
    r.w = select(r.refracted, through, h * (2.0f * cosine) - view);
    r.value = select(r.refracted, s.transmitted, s.reflected) * (1.0f / max(r.probability, 1e-20f));
    return r;
}

}  // namespace edgegrad::EDGEGRAD_ISA
