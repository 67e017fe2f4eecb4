// A field's coefficients in blocks as large as its bricks: which of them have changed, and which have one
// sign.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sdf/field_view.h"

namespace edgegrad {

// Cells of a brick, and coefficients of a block, along each axis. Larger bricks cost more steps along a ray,
// smaller ones more primitives.
constexpr int32_t kBrickCells = 8;

// The numbers of blocks along the axes; those at the ends may be smaller.
struct BlockGrid {
    explicit BlockGrid(const int32_t (&coefficients)[3]) {
        for (int a = 0; a < 3; ++a) size[a] = (coefficients[a] + kBrickCells - 1) / kBrickCells;
    }
    size_t number(int32_t i, int32_t j, int32_t k) const {
        return (static_cast<size_t>(i) * static_cast<size_t>(size[1]) + static_cast<size_t>(j)) *
                   static_cast<size_t>(size[2]) +
               static_cast<size_t>(k);
    }
    size_t count() const { return number(size[0], 0, 0); }
    // The eight blocks that the cells of a brick read: along each axis its own block, and the first three
    // coefficients of the next.
    size_t read_by_brick(int32_t i, int32_t j, int32_t k, int32_t corner) const {
        return number(std::min(i + (corner >> 2), size[0] - 1), std::min(j + (corner >> 1 & 1), size[1] - 1),
                      std::min(k + (corner & 1), size[2] - 1));
    }

    int32_t size[3];
};

// Copies those coefficients that differ. Returns by block whether any did; empty: none did.
std::vector<uint8_t> copy_changes(const float* from, float* to, const int32_t (&size)[3], int threads);

// Bits of the signs that all coefficients of a block have.
enum BlockSign : uint8_t { kPositiveBlock = 1, kNegativeBlock = 2 };

// Finds the signs of the blocks again that have changed (empty: of all).
void find_signs(const FieldView& field, const std::vector<uint8_t>& changed, int threads,
                std::vector<uint8_t>& signs);

}  // namespace edgegrad
