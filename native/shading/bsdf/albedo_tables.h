// Directional albedos of GGX surfaces (make_albedo_tables.py describes them).
#pragma once

namespace edgegrad {

constexpr int kReflectionTable = 32, kInterfaceTable = 16;

extern const float kReflectionAlbedo[];      // cosine, roughness
extern const float kReflectionMeanAlbedo[];  // roughness
extern const float kGlassAlbedo[];           // z, cosine, roughness
extern const float kGlassMeanAlbedo[];       // z, roughness
extern const float kGlassInsideAlbedo[];
extern const float kGlassInsideMeanAlbedo[];
extern const float kReflectionFresnel[];  // z, cosine, roughness

}  // namespace edgegrad
