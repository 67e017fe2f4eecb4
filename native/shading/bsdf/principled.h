// Blender's Principled BSDF with the layers of Cycles 4.2 to 5.2: sheen over coat over a mix of metal,
// dielectric interface (transmission), and dielectric mirror over diffuse. Each layer attenuates the layers
// below by its albedo. Subsurface scattering is replaced by its diffuse limit.
#pragma once

#include "shading/bsdf/shaders.h"
#include "shading/bsdf/shading_normal.h"

namespace edgegrad::EDGEGRAD_ISA {

// Smaller weights count as zero (the limit of Cycles).
constexpr float kLeastWeight = 1e-5f;

// A weight of zero may still have a derivative.
EG_INLINE Mask is_there(Float weight) { return (weight > kLeastWeight) | has_derivative(weight); }

// Whether any lane of the packet may have a layer. Absent layers cost nothing.
struct Occurs {
    bool sheen, coat, metal, transmission, dielectric;
};

// `film`: lanes under a thin film, which reflects without a dielectric level, too.
EG_INLINE Occurs occurs(Mask m, const MaterialValues& v, Mask film) {
    const Mask below = ((v.metallic < 1.0f) | has_derivative(v.metallic)) &
                       ((v.transmission < 1.0f) | has_derivative(v.transmission));
    return {any(m & is_there(v.sheen_weight)), any(m & is_there(v.coat_weight)),
            any(m & is_there(v.metallic)), any(m & is_there(v.transmission)),
            any(m & ((v.specular_ior_level > 0.0f) | has_derivative(v.specular_ior_level) | film) & below)};
}

// Transmittance of a coat's tint along both directions. The tint applies at normal incidence; elsewhere the
// path in the coat is longer by the inverse refracted cosine.
EG_INLINE Vec3 coat_filter(const MaterialValues& v, Float cosine) {
    const Float inverse = 1.0f / max(v.coat_ior, 1.0f);
    const Float depth = 1.0f / sqrt(max(1.0f - inverse * inverse * (1.0f - cosine * cosine), 1e-6f));
    const auto power = [depth](Float t) {
        return select(t > 0.0f, pow_positive(max(t, 1e-20f), depth), 0.0f);
    };
    const Vec3 tint = {power(v.coat_tint.x), power(v.coat_tint.y), power(v.coat_tint.z)};
    // A coat weight above 1 could make the transmittance negative, which counts as 0.
    const Vec3 share = mix(white(), tint, v.coat_weight);
    return {max(share.x, 0.0f), max(share.y, 0.0f), max(share.z, 0.0f)};
}

// Sheen and coat of a packet, and the attenuation of the layers below.
struct Cover {
    Vec3 below;
    Sheen sheen;
    Vec3 coat;  // weight of the coat's Fresnel reflectance
    Float coat_albedo;
};

EG_INLINE Cover make_cover(const Occurs& has, Mask m, const MaterialValues& v, Vec3 n, Vec3 wo, Float cosine,
                           Float mirror_cosine) {
    Cover c;
    c.below = white();
    c.coat = zero3();
    c.coat_albedo = splat(0.0f);
    // Add the sheen layer
    if (has.sheen) {
        const Mask covered = m & is_there(v.sheen_weight);
        c.sheen = make_sheen(n, wo, cosine, saturate(v.sheen_roughness));
        c.sheen.weight = select(covered, c.sheen.weight * v.sheen_tint * v.sheen_weight, zero3());
        c.below = below(c.below, c.sheen.weight);
    }
    // Add the coat layer
    if (has.coat) {
        const Mask covered = m & is_there(v.coat_weight);
        const Float rough = saturate(v.coat_roughness), ior = max(v.coat_ior, 1.0f);
        const Compensation more =
            compensation(reflection_albedo(rough, mirror_cosine), splat3(mean_dielectric(ior)));
        const Vec3 weight = c.below * more.darkening * select(covered, v.coat_weight, splat(0.0f));
        const Float f0 = f0_of_ior(ior);
        c.coat_albedo = f0 + (1.0f - f0) * reflection_fresnel(rough, mirror_cosine, ior);
        c.coat = weight * more.scale;
        c.below = below(c.below, weight * c.coat_albedo);
        c.below = c.below * select(covered, coat_filter(v, mirror_cosine), white());
    }
    return c;
}

// Share of the emission that passes sheen and coat towards wo.
EG_INLINE Vec3 emission_share(Mask m, const MaterialValues& v, Vec3 n, Vec3 ng, Vec3 wo) {
    const Occurs has = occurs(m, v, splat(0));
    if (!has.sheen && !has.coat) return white();
    return make_cover(has, m, v, n, wo, dot(n, wo), dot(valid_mirror_normal(n, ng, wo), wo)).below;
}

// Index and reflectance at normal incidence of the dielectric mirror.
struct DielectricLevel {
    Float eta, f0;
};
EG_INLINE DielectricLevel dielectric_level(const MaterialValues& v) {
    const Float ior = max(v.ior, 1e-5f);
    const Float f0 = f0_of_ior(ior);
    const Mask changed = (v.specular_ior_level != 0.5f) | has_derivative(v.specular_ior_level);
    Float scaled = f0 * (2.0f * v.specular_ior_level);
    // The index depends on the square root of the reflectance, which has no derivative at 0. The derivative
    // is evaluated just beside 0.
    const Mask beside = has_derivative(v.specular_ior_level);
    if (any(beside)) scaled = scaled + detach(max(1e-6f - scaled, 0.0f));
    const Float eta = ior_of_f0(scaled);
    return {select(changed, select(ior < 1.0f, 1.0f / eta, eta), ior), select(changed, scaled, f0)};
}

EG_INLINE void add_principled(Bsdf& f, Mask m, const MaterialValues& v, Int flags, Mask from_inside) {
    const Film film = film_of(m, v, flags, splat(1.0f));
    const Occurs has = occurs(m, v, film.there);
    const Float rough = saturate(v.roughness), cosine = f.view.z;
    const Float alpha = rough * rough;
    // Add sheen and coat
    Vec3 weight = white();
    if (has.sheen || has.coat) {
        const Cover cover = make_cover(has, m, v, f.normal, f.wo, f.cosine, cosine);
        weight = cover.below;
        if (has.sheen) {
            f.sheen = f.any_lobe[kSheenLobe] ? select_sheen(m, cover.sheen, f.sheen) : cover.sheen;
            f.any_lobe[kSheenLobe] = true;
            f.probability[kSheenLobe] =
                select(m, average(detach(cover.sheen.weight)), f.probability[kSheenLobe]);
        }
        if (has.coat) {
            const Float coat_rough = saturate(v.coat_roughness), coat_alpha = coat_rough * coat_rough;
            f.coat = no_reflection();
            f.coat.facets = make_facets(coat_alpha, coat_alpha, f.view);
            f.coat.dielectric = select(m, cover.coat, zero3());
            f.coat.eta = max(v.coat_ior, 1.0f);
            f.coat.f0 = splat3(f0_of_ior(f.coat.eta));
            f.coat.any_dielectric = f.any_lobe[kCoatLobe] = true;
            f.probability[kCoatLobe] =
                select(m, average(detach(cover.coat)) * detach(cover.coat_albedo), 0.0f);
        }
    }
    f.emission = select(m, v.emission * weight, f.emission);

    // Prepare the mirror lobe of metal and dielectric
    const bool mirrors = has.metal || has.dielectric;
    const Mask multiscatter = has_flag(flags, kMultiscatter);
    Albedo albedo{};
    if (mirrors) {
        const Float aspect = sqrt(1.0f - 0.9f * saturate(v.anisotropy));
        const Microfacets facets =
            shaped_facets(m, min(alpha / aspect, splat(1.0f)), alpha * aspect, f.turned_view, flags);
        f.mirror.facets = select_facets(m, facets, f.mirror.facets);
        // Like Cycles, look up the roughness of the clamped alphas.
        albedo = reflection_albedo(sqrt(sqrt(facets.ax * facets.ay)), cosine);
        f.mirror.film = select_film(m, film, f.mirror.film);
        f.any_lobe[kMirrorLobe] = true;
    }
    // Add metal
    if (has.metal) {
        const Float metallic = select(is_there(v.metallic), saturate(v.metallic), splat(0.0f));
        const Vec3 f0 = saturate(v.base_color);
        const Vec3 tint = {min(v.specular_tint.x, splat(1.0f)), min(v.specular_tint.y, splat(1.0f)),
                           min(v.specular_tint.z, splat(1.0f))};
        const Vec3 b = f82_b(f0, tint);
        const Compensation more = compensation(albedo, mean_f82(f0, b));
        const Vec3 scaled = weight * metallic * select(multiscatter, more.darkening * more.scale, white());
        f.mirror.metal = select(m, scaled, f.mirror.metal);
        f.mirror.metal_f0 = select(m, f0, f.mirror.metal_f0);
        f.mirror.b = select(m, b, f.mirror.b);
        f.mirror.any_metal = true;
        f.probability[kMirrorLobe] = select(
            m, average(detach(scaled) * mix(detach(f0), white(), pow5(1.0f - saturate(detach(cosine))))),
            f.probability[kMirrorLobe]);
        weight = weight * (1.0f - metallic);
    }
    // Add transmission
    if (has.transmission) {
        const Float share = select(is_there(v.transmission), saturate(v.transmission), splat(0.0f));
        const Float ior = max(v.ior, 1e-5f), eta = select(from_inside, 1.0f / ior, ior);
        const Vec3 base = saturate(v.base_color);
        const Vec3 tint = {sqrt(base.x), sqrt(base.y), sqrt(base.z)};
        add_interface(f, m, alpha, rough, eta, saturate(v.specular_tint * f0_of_ior(ior)), white(), tint,
                      weight * share, flags, film_of(m, v, flags, select(from_inside, 1.0f / ior, 1.0f)));
        weight = weight * (1.0f - share);
    }
    // Add the dielectric mirror
    if (has.dielectric) {
        const DielectricLevel level = dielectric_level(v);
        const Mask there = m & ((level.eta != 1.0f) | has_derivative(level.eta) | film.there);
        const Vec3 f0 = saturate(v.specular_tint * level.f0);
        const Float share = fresnel_share(mean_dielectric(level.eta), f0_of_ior(level.eta));
        const Compensation more = compensation(albedo, mix(f0, white(), share));
        const Vec3 darkened = weight * select(multiscatter, more.darkening, white());
        Vec3 fresnel =
            mix(f0, white(),
                reflection_fresnel(sqrt(sqrt(f.mirror.facets.ax * f.mirror.facets.ay)), cosine, level.eta));
        // Like Cycles, take films as smooth: there is no table of rough ones.
        if (film.any) fresnel = select(film.there, film_fresnel(film, cosine, level.eta, f0), fresnel);
        const Vec3 reflected = darkened * fresnel;
        f.mirror.dielectric =
            select(there, darkened * select(multiscatter, more.scale, splat(1.0f)), zero3());
        f.mirror.f0 = f0;
        f.mirror.eta = level.eta;
        f.mirror.any_dielectric = true;
        f.probability[kMirrorLobe] =
            f.probability[kMirrorLobe] + select(there, average(detach(reflected)), splat(0.0f));
        weight = select(there, below(weight, reflected), weight);
    }
    // Add the diffuse base
    const Vec3 diffuse = v.base_color * weight;
    const Mask colored = (largest_component(diffuse) > 0.0f) | has_derivative(diffuse.x);
    if (any(m & colored)) add_diffuse(f, m, v, diffuse);
}

}  // namespace edgegrad::EDGEGRAD_ISA
