// A closure's values at a point, as the BSDFs read them.
#pragma once

#include "scene/material_params.h"
#include "simd/vector.h"

namespace edgegrad::EDGEGRAD_ISA {

EG_INLINE Mask has_flag(Int flags, int32_t flag) { return (flags & flag) != 0; }

struct MaterialValues {
    Vec3 base_color, emission;
    Float metallic, roughness, diffuse_roughness, specular_ior_level;
    Vec3 specular_tint;
    Float ior, anisotropy, anisotropy_rotation, transmission;
    Float coat_weight, coat_roughness, coat_ior;
    Vec3 coat_tint;
    Float sheen_weight, sheen_roughness;
    Vec3 sheen_tint;
    Float film_thickness, film_ior;
};

// Reads a row of scene/material_params.h.
EG_INLINE MaterialValues material_values(const Float* row) {
    const auto color = [row](int place) { return Vec3{row[place], row[place + 1], row[place + 2]}; };
    MaterialValues m;
    m.base_color = color(kBaseColor);
    m.emission = color(kEmission);
    m.metallic = row[kMetallic];
    m.roughness = row[kRoughness];
    m.diffuse_roughness = row[kDiffuseRoughness];
    m.specular_ior_level = row[kSpecularIorLevel];
    m.specular_tint = color(kSpecularTint);
    m.ior = row[kIor];
    m.anisotropy = row[kAnisotropy];
    m.anisotropy_rotation = row[kAnisotropyRotation];
    m.transmission = row[kTransmission];
    m.coat_weight = row[kCoatWeight];
    m.coat_roughness = row[kCoatRoughness];
    m.coat_ior = row[kCoatIor];
    m.coat_tint = color(kCoatTint);
    m.sheen_weight = row[kSheenWeight];
    m.sheen_roughness = row[kSheenRoughness];
    m.sheen_tint = color(kSheenTint);
    m.film_thickness = row[kThinFilmThickness];
    m.film_ior = row[kThinFilmIor];
    return m;
}

}  // namespace edgegrad::EDGEGRAD_ISA
