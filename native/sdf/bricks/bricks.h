// The parts of a field in which its surface may be: the primitives of Embree's BVH.
#pragma once

#include <vector>

#include "embree/api.h"
#include "sdf/bricks/coefficient_blocks.h"

namespace edgegrad {

// Neighbouring bricks overlap by this many cells, so that rounding loses no crossing between two of them.
constexpr float kBrickOverlap = 1.0f / 256.0f;

// Cells [first, last) within which not all are proven empty. In a cell the spline is a convex combination of
// the Bezier points of its polynomial: a cell whose points have one sign is empty, whether or not the field
// is a distance.
struct alignas(64) FieldBrick {
    // What decides on most rays stands in one cache line.
    // The box of the cells with the overlap, as far as the field reaches; the fourth axis is unbounded.
    float lower[4], upper[4];
    // In the brick the spline differs by `error` at most from an affine function, by its value at `first` and
    // its slopes. Most rays that miss the surface, and most of the way of the others, are ruled out by that.
    float value, slope[3], error;
    int32_t first[3], last[3];
    // Bounds of the second derivatives xx, yy, zz, yz, xz, xy: extremes of differences of the coefficients.
    float low[6], high[6];

    // Whether it consists of cells from `cell` on.
    bool is_from(const int32_t (&cell)[3]) const {
        const auto same = [&](int a) { return first[a] / kBrickCells == cell[a] / kBrickCells; };
        return same(0) && same(1) && same(2);
    }
};

// A field with its bricks, in the order of the grid: what callbacks of Embree read.
struct TracedField {
    FieldView view;
    double to_grid[4][4];  // columns of the view's map, with a fourth row of zeros
    std::vector<FieldBrick> bricks;

    void set_view(const FieldView& next);

    // Finds the bricks again of which a block of coefficients has changed (empty: all). The view has the
    // signs of all blocks.
    void find_bricks(const std::vector<uint8_t>& changed, int threads);
    // A box around a brick in the world.
    void bounds(size_t brick, embree::Bounds& box) const;
};

}  // namespace edgegrad
