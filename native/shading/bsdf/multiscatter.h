// Energy of light that is scattered between microfacets more than once, as a factor on single scattering:
// Cycles' albedo scaling, after Kulla and Conty 2017, "Revisiting Physically Based Shading at Imageworks".
#pragma once

#include "shading/bsdf/fresnel.h"
#include "shading/bsdf/tables/albedo_tables.h"
#include "shading/bsdf/tables/table_lookup.h"

namespace edgegrad::EDGEGRAD_ISA {

struct Albedo {
    Float toward, mean;  // towards the view, and averaged over all directions
};

EG_INLINE Albedo reflection_albedo(Float rough, Float cosine) {
    const TablePlace x = table_place(rough, kReflectionTable);
    return {
        table_plane(kReflectionAlbedo, splat(0), x, table_place(cosine, kReflectionTable), kReflectionTable),
        table_row(kReflectionMeanAlbedo, splat(0), x)};
}

// The tables' axis of relative indices.
EG_INLINE TablePlace ior_place(Float eta) {
    return table_place(sqrt(abs((eta - 1.0f) / (eta + 1.0f))), kInterfaceTable);
}

// Albedo of an interface with both reflection and refraction.
EG_INLINE Albedo interface_albedo(Float rough, Float cosine, Float eta) {
    const TablePlace x = table_place(rough, kInterfaceTable), y = table_place(cosine, kInterfaceTable);
    const TablePlace z = ior_place(eta);
    Albedo a = {table_volume(kGlassAlbedo, x, y, z, kInterfaceTable),
                table_plane(kGlassMeanAlbedo, splat(0), x, z, kInterfaceTable)};
    const Mask inside = eta < 1.0f;
    if (any(inside)) {
        a.toward = select(inside, table_volume(kGlassInsideAlbedo, x, y, z, kInterfaceTable), a.toward);
        a.mean = select(inside, table_plane(kGlassInsideMeanAlbedo, splat(0), x, z, kInterfaceTable), a.mean);
    }
    return a;
}

// Mean position between f0 and 1 of the Fresnel reflectance of a rough dielectric.
EG_INLINE Float reflection_fresnel(Float rough, Float cosine, Float eta) {
    return table_volume(kReflectionFresnel, table_place(rough, kInterfaceTable),
                        table_place(cosine, kInterfaceTable), ior_place(eta), kInterfaceTable);
}

// Energy compensation of a closure with the mean single-scattering reflectance `fresnel`. `scale` scales the
// albedo to 1; `darkening` then applies the absorption of repeated reflections. Fss is the part of this
// absorption that single scattering already contains.
struct Compensation {
    Float scale;
    Vec3 darkening;
};
EG_INLINE Compensation compensation(Albedo a, Vec3 fresnel) {
    const Float missing = (1.0f - a.toward) / max(a.toward, 1e-4f);
    const Float scale = 1.0f + missing;
    // Colours above 1 reflect more than arrives. The sum of the repeated reflections then diverges, and
    // beyond its pole the closed form is negative.
    constexpr float kLeastLoss = 0.1f;
    const auto loss = [&](Float f) { return max(1.0f - f * (1.0f - a.mean), kLeastLoss); };
    const Vec3 repeated = divide(fresnel * a.mean, {loss(fresnel.x), loss(fresnel.y), loss(fresnel.z)});
    return {scale, (white() + repeated * missing) * (1.0f / scale)};
}

// Attenuation below a layer that reflects `albedo` (Cycles' layering).
EG_INLINE Float below_share(Float albedo, Float weight) {
    return select(weight > 0.0f, albedo / max(weight, 1e-30f), 0.0f);
}
EG_INLINE Vec3 below(Vec3 weight, Vec3 albedo) {
    const Float most = max(max(below_share(albedo.x, weight.x), below_share(albedo.y, weight.y)),
                           below_share(albedo.z, weight.z));
    return weight * saturate(1.0f - most);
}

}  // namespace edgegrad::EDGEGRAD_ISA
