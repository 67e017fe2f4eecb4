// Blender's simple shaders as lobes.
#pragma once

#include "shading/bsdf/closures.h"
#include "shading/bsdf/material_values.h"
#include "shading/bsdf/multiscatter.h"

namespace edgegrad::EDGEGRAD_ISA {

EG_INLINE Microfacets select_facets(Mask m, const Microfacets& a, const Microfacets& b) {
    return {select(m, a.ax, b.ax),
            select(m, a.ay, b.ay),
            select(m, a.stretched, b.stretched),
            select(m, a.masking, b.masking),
            select(m, a.bound, b.bound),
            select(m, a.by_score, b.by_score),
            select(m, a.followed, b.followed),
            select(m, a.tail, b.tail),
            a.others || b.others,
            select(m, a.beckmann, b.beckmann),
            select(m, a.phong, b.phong)};
}

// Microfacets of the lanes' distributions.
EG_INLINE Microfacets shaped_facets(Mask m, Float ax, Float ay, Vec3 view, Int flags) {
    Microfacets g = make_facets(ax, ay, view);
    const Mask other = m & has_flag(flags, kBeckmann | kPhong);
    if (any(other))
        set_other_distribution(g, other & has_flag(flags, kBeckmann), other & has_flag(flags, kPhong), view);
    return g;
}
EG_INLINE Sheen select_sheen(Mask m, const Sheen& a, const Sheen& b) {
    return {select(m, a.weight, b.weight), select(m, a.x, b.x),        select(m, a.y, b.y),
            select(m, a.a, b.a),           select(m, a.b, b.b),        a.any_velvet || b.any_velvet,
            select(m, a.velvet, b.velvet), select(m, a.sigma, b.sigma)};
}

EG_INLINE OrenNayar select_oren_nayar(Mask m, const OrenNayar& a, const OrenNayar& b) {
    return {select(m, a.a, b.a), select(m, a.b, b.b), select(m, a.repeated, b.repeated)};
}

// Smallest diffuse roughness that counts.
constexpr float kLeastSigma = 1e-5f;

// Adds a diffuse lobe with the weight `color`; v.base_color is the albedo of multiple scattering.
EG_INLINE void add_diffuse(Bsdf& f, Mask m, const MaterialValues& v, Vec3 color) {
    f.diffuse = select(m, color, f.diffuse);
    f.any_lobe[kDiffuseLobe] = true;
    f.probability[kDiffuseLobe] = select(m, average(detach(color)), f.probability[kDiffuseLobe]);
    const Mask rough = m & ((v.diffuse_roughness > kLeastSigma) | has_derivative(v.diffuse_roughness));
    if (!any(rough)) return;
    Float sigma = select(rough, saturate(v.diffuse_roughness), splat(0.0f));
    // The multiple-scattering term is 0/0 at sigma = 0. Its derivative is evaluated just beside 0.
    sigma = select(rough, sigma + detach(max(kLeastSigma - sigma, 0.0f)), sigma);
    const OrenNayar o = make_oren_nayar(sigma, v.base_color, f.cosine);
    f.oren_nayar = f.any_oren_nayar ? select_oren_nayar(m, o, f.oren_nayar) : o;
    f.any_oren_nayar = true;
}

EG_INLINE void add_translucent(Bsdf& f, Mask m, const MaterialValues& v) {
    f.translucent = select(m, v.base_color, zero3());
    f.any_lobe[kTranslucentLobe] = true;
    f.probability[kTranslucentLobe] = select(m, average(detach(v.base_color)), splat(0.0f));
}

EG_INLINE void add_glossy(Bsdf& f, Mask m, const MaterialValues& v, Int flags) {
    const Float rough = saturate(v.roughness), alpha = rough * rough;
    // Clamped so that no alpha becomes 0.
    const Float a = clamp(v.anisotropy, splat(-0.99f), splat(0.99f));
    const Float narrow = 1.0f - abs(a);
    const Float less = alpha * narrow, more = min(alpha / narrow, splat(1.0f));
    const Microfacets facets =
        shaped_facets(m, select(a < 0.0f, more, less), select(a < 0.0f, less, more), f.turned_view, flags);
    f.mirror.facets = select_facets(m, facets, f.mirror.facets);
    Vec3 weight = v.base_color;
    const Mask multiscatter = m & has_flag(flags, kMultiscatter);
    if (any(multiscatter)) {
        const Compensation c = compensation(reflection_albedo(sqrt(sqrt(facets.ax * facets.ay)), f.view.z),
                                            saturate(v.base_color));
        weight = select(multiscatter, weight * c.darkening * c.scale, weight);
    }
    f.mirror.constant = select(m, weight, f.mirror.constant);
    f.any_lobe[kMirrorLobe] = true;
    f.probability[kMirrorLobe] = select(m, average(detach(weight)), f.probability[kMirrorLobe]);
}

// Adds an interface with the roughness `rough` = sqrt(alpha) and tints of reflection and transmission.
EG_INLINE void add_interface(Bsdf& f, Mask m, Float alpha, Float rough, Float eta, Vec3 f0, Vec3 reflection,
                             Vec3 transmission, Vec3 weight, Int flags, const Film& film) {
    Interface& g = f.glass;
    const Mask multiscatter = has_flag(flags, kMultiscatter);
    if (any(multiscatter)) {
        const Compensation c = compensation(interface_albedo(rough, f.view.z, eta), transmission);
        weight = select(multiscatter, weight * c.darkening * c.scale, weight);
    }
    g.facets = select_facets(m, shaped_facets(m, alpha, alpha, f.view, flags), g.facets);
    g.eta = select(m, eta, g.eta);
    g.f0 = select(m, f0, g.f0);
    g.film = select_film(m, film, g.film);
    g.reflection = select(m, weight * reflection, g.reflection);
    g.transmission = select(m, weight * transmission, g.transmission);
    // Beyond the critical angle, tilted microfacets may still refract.
    const Split s = split_light(g, f.view.z);
    f.any_lobe[kInterfaceLobe] = true;
    f.probability[kInterfaceLobe] = select(m,
                                           max(average(detach(s.reflected + s.transmitted)),
                                               0.1f * average(detach(g.reflection + g.transmission))),
                                           f.probability[kInterfaceLobe]);
}

// The film of lanes that have one. The index of the viewer's side is 1 / `inside` there.
EG_INLINE Film film_of(Mask m, const MaterialValues& v, Int flags, Float inside) {
    const Mask film = m & has_flag(flags, kThinFilm);
    return any(film) ? make_film(film, v.film_thickness, max(v.film_ior, 1e-5f) * inside) : no_film();
}

EG_INLINE void add_glass(Bsdf& f, Mask m, const MaterialValues& v, Int flags, Mask from_inside) {
    const Float rough = saturate(v.roughness), ior = max(v.ior, 1e-5f);
    add_interface(f, m, rough * rough, rough, select(from_inside, 1.0f / ior, ior), splat3(f0_of_ior(ior)),
                  v.base_color, v.base_color, white(), flags,
                  film_of(m, v, flags, select(from_inside, 1.0f / ior, 1.0f)));
}

EG_INLINE void add_refraction(Bsdf& f, Mask m, const MaterialValues& v, Int flags, Mask from_inside) {
    const Float rough = saturate(v.roughness), ior = max(v.ior, 1e-5f);
    f.glass.refracts_only |= m;
    add_interface(f, m, rough * rough, rough, select(from_inside, 1.0f / ior, ior), splat3(f0_of_ior(ior)),
                  zero3(), v.base_color, white(), flags & ~kMultiscatter, no_film());
}

EG_INLINE void add_sheen(Bsdf& f, Mask m, const MaterialValues& v) {
    Sheen s = make_sheen(f.normal, f.wo, f.cosine, saturate(v.roughness));
    s.weight = s.weight * v.base_color;
    if (f.any_lobe[kSheenLobe])
        f.sheen = select_sheen(m, s, f.sheen);
    else
        f.sheen = s, f.sheen.weight = select(m, s.weight, zero3());
    f.any_lobe[kSheenLobe] = true;
    f.probability[kSheenLobe] = select(m, average(detach(s.weight)), f.probability[kSheenLobe]);
}

EG_INLINE void add_velvet(Bsdf& f, Mask m, const MaterialValues& v) {
    if (!f.any_lobe[kSheenLobe]) f.sheen = no_sheen(f.normal);
    f.sheen.any_velvet = true;
    f.sheen.velvet = m;
    f.sheen.sigma = max(saturate(v.roughness), kLeastVelvetSigma);
    f.sheen.weight = select(m, v.base_color, f.sheen.weight);
    f.any_lobe[kSheenLobe] = true;
    f.probability[kSheenLobe] = select(m, average(detach(v.base_color)), f.probability[kSheenLobe]);
}

// Burley 2012 as in Mitsuba 3's `principled`, with the parameters base_color, roughness and metallic, and
// with specular_ior_level in place of `specular`. The back is like the front.
EG_INLINE void add_disney(Bsdf& f, Mask m, const MaterialValues& v) {
    const Float alpha = max(v.roughness * v.roughness, 1e-3f);
    f.mirror.facets = select_facets(m, make_facets(alpha, alpha, f.view), f.mirror.facets);
    const Float dielectric_share = 1.0f - v.metallic;
    const Float eta = 2.0f / (1.0f - sqrt(0.08f * max(v.specular_ior_level, 1e-3f))) - 1.0f;
    const Float f0 = f0_of_ior(eta);
    f.mirror.metal = select(m, splat3(v.metallic), f.mirror.metal);
    f.mirror.metal_f0 = select(m, v.base_color, f.mirror.metal_f0);
    f.mirror.b = select(m, zero3(), f.mirror.b);
    f.mirror.dielectric = select(m, splat3(dielectric_share), f.mirror.dielectric);
    f.mirror.f0 = select(m, splat3(f0), f.mirror.f0);
    f.mirror.eta = select(m, eta, f.mirror.eta);
    f.mirror.any_metal = f.mirror.any_dielectric = true;
    f.mirror.separable |= m;
    f.any_lobe[kMirrorLobe] = f.any_lobe[kDiffuseLobe] = true;
    f.diffuse = select(m, v.base_color * dielectric_share, f.diffuse);
    f.burley = select(m, v.roughness, f.any_burley ? f.burley : splat(-1.0f));
    f.any_burley = true;
    const Float cosine = saturate(f.view.z);
    f.probability[kMirrorLobe] =
        select(m, max(average(detach(reflectance(f.mirror, cosine))), 0.05f), f.probability[kMirrorLobe]);
    f.probability[kDiffuseLobe] =
        select(m, average(detach(f.diffuse)) * (1.0f - 0.5f * pow5(1.0f - detach(cosine))),
               f.probability[kDiffuseLobe]);
}

}  // namespace edgegrad::EDGEGRAD_ISA
