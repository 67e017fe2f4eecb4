// Where textures jump within a face.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scene/tables.h"
#include "scene/view.h"

namespace edgegrad {

// The cells over which a texture does not jump: texels of an image without interpolation, squares of a
// checkerboard, or those between whole numbers. A border is where a coordinate of a cell is a whole number.
// The coordinates, up to three, are linear functions of the first three components of an attribute, and 1.
struct CellGrid {
    int32_t attribute;
    float row[kCellCoordinates][4];
    bool operator==(const CellGrid&) const = default;
};

// What a closure's textures jump at: borders of cells, and `elsewhere`, if they may jump in other places.
// `by_images`: where they jump depends on values of images, such as an alpha that is cut off at 0.5.
// `past_hues`: a hue becomes a color that jumps at each sixth outside of [0, 1], as in Cycles. Hues that lie
// within now may leave it where values are requested.
struct TextureJumps {
    bool elsewhere = false, by_images = false, past_hues = false;
    std::vector<CellGrid> grids;

    bool any() const { return elsewhere || !grids.empty(); }
};

TextureJumps texture_jumps(const SceneTables& tables, size_t closure);

// Where the textures of materials jump.
struct MaterialJumps {
    std::vector<TextureJumps> of;  // by material: of all of its closures, each grid once
    std::vector<int32_t> any;      // 1: the material's textures jump; empty if no material's do
};
MaterialJumps material_jumps(const SceneTables& tables);

}  // namespace edgegrad
