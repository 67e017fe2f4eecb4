// One closure's values as a row of floats: the positions of its fields (the same as in
// core/tables/materials.py).
#pragma once

#include <cstdint>

namespace edgegrad {

// Kinds of closures, in the order of KINDS in core/scene/material.py.
enum ShaderKind : int32_t {
    kPrincipled,
    kDiffuse,
    kGlossy,
    kGlass,
    kRefraction,
    kTransparent,
    kTranslucent,
    kSheen,
    kDisney,
    kVelvet
};

// Values of the shader; the rest of the row belongs to the material.
constexpr int kShaderParams = 36;

enum MaterialParam : int32_t {
    kBaseColor = 0,
    kEmission = 3,
    kMetallic = 6,
    kRoughness = 7,
    kDiffuseRoughness = 8,
    kSpecularIorLevel = 9,
    kSpecularTint = 10,
    kIor = 13,
    kAnisotropy = 14,
    kAnisotropyRotation = 15,
    kTransmission = 16,
    kCoatWeight = 17,
    kCoatRoughness = 18,
    kCoatIor = 19,
    kCoatTint = 20,
    kSheenWeight = 23,
    kSheenRoughness = 24,
    kSheenTint = 25,
    kAlpha = 28,
    kSubsurfaceWeight = 29,
    kNormalMap = 30,
    kNormalStrength = 33,
    kWeight = 34,  // of the closure in its mixture
    kThinFilmThickness = 35,
    kThinFilmIor = 36,  // loaded for scenes with films only, behind the shader's other values
    kAbsorption = 37,   // 1/m, in the mesh behind the surface (shading/absorption.h)
    kMaterialParams = 40
};

// Features that may occur in a closure (`closure_flags`), so that code for others is skipped.
enum ClosureFlag : int32_t {
    kHasGlossy = 1 << 1,        // any microfacet reflection or refraction, coat, sheen
    kHasTransparency = 1 << 2,  // alpha below 1, or Transparent
    kHasEmission = 1 << 3,
    kHasNormalMap = 1 << 4,
    kMultiscatter = 1 << 5,
    kEmissionTwoSided = 1 << 6,
    kHasRefraction = 1 << 7,
    kLambertian = 1 << 8,  // nothing but a constant or textured diffuse colour and emission
    kAnisotropic = 1 << 9,
    kBeckmann = 1 << 10,       // distribution of microfacets, in place of GGX
    kPhong = 1 << 11,          // the reflection of Ashikhmin and Shirley
    kNormalInWorld = 1 << 12,  // the program returns the shading normal instead of the colour of a normal map
    kHasAbsorption = 1 << 13,
    kThinFilm = 1 << 14,
    kNormalBelow = 1 << 15  // the shading normal may point below the smooth surface
};

// The gloss over a diffuse base is weak: following it pays only where its alpha is below this part of the
// limit for other lobes.
constexpr float kWeakGloss = 0.25f;

}  // namespace edgegrad
