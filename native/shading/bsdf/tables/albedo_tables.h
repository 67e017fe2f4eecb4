// Directional albedos of GGX surfaces (make_albedo_tables.py), the sheen's coefficients
// (make_sheen_tables.py), and the channels' sensitivities to thin films (make_film_table.py).
#pragma once

namespace edgegrad {

constexpr int kReflectionTable = 32, kInterfaceTable = 16, kSheenTable = 32, kFilmTable = 512;

extern const float kReflectionAlbedo[];      // cosine, roughness
extern const float kReflectionMeanAlbedo[];  // roughness
extern const float kGlassAlbedo[];           // z, cosine, roughness
extern const float kGlassMeanAlbedo[];       // z, roughness
extern const float kGlassInsideAlbedo[];
extern const float kGlassInsideMeanAlbedo[];
extern const float kReflectionFresnel[];  // z, cosine, roughness

extern const float kSheenA[];  // roughness, cosine
extern const float kSheenB[];
extern const float kSheenAlbedo[];

extern const float kFilmSensitivity[];  // real and imaginary parts of red, green and blue

}  // namespace edgegrad
