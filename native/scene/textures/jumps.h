// Where textures jump within a face.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scene/tables.h"

namespace edgegrad {

// The texels of an image without interpolation: their borders are where a texel coordinate is a whole number.
// A texel coordinate is a linear function of the first three components of an attribute, and 1.
struct TexelGrid {
    int32_t attribute;
    float across[4], up[4];
    bool operator==(const TexelGrid&) const = default;
};

// What a closure's textures jump at: borders of texels, and `elsewhere`, if they may jump in other places.
struct TextureJumps {
    bool elsewhere = false;
    std::vector<TexelGrid> grids;
};

TextureJumps texture_jumps(const SceneTables& tables, size_t closure);

}  // namespace edgegrad
