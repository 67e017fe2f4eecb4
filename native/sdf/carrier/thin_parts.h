// Parts of a distance field's surface that are thinner than a cell.
//
// Marching finds the surface by the signs of the field at the corners of cells. A part that lies between
// corners, such as a speck, a thin sheet or a tip, changes no sign there. Its cells are those that may have
// the surface, and no neighbour of which has corners of both signs. (Beside cells with both signs, a surface
// may bulge between corners. Carriers cover such bulges: points of their triangles are moved onto the
// surface.) The spline on equal parts of these cells shows whether there is a surface, and how small the
// parts have to be.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sdf/carrier/marching.h"

namespace edgegrad {

// Cells whose parts are marched, in order: all cells over which a surface continues that has a thin part.
struct FineRegion {
    std::vector<Cell> cells;
    int parts = 1;         // of a cell along each axis
    bool crosses = false;  // some of them have corners of both signs
    bool complete = true;  // no thin part is left out, because there would be too many parts of cells

    bool contains(const Cell& cell) const;
};

class ThinParts {
 public:
    explicit ThinParts(const FieldView& field);
    // Adds a cell that may have the surface, in order. `crosses`: its corners have both signs.
    void add(const Cell& cell, bool crosses);
    // To call after the last cell.
    FineRegion region();

 private:
    enum State : uint8_t { kNone, kMixed, kCrosses };

    void close_slab();  // looks for thin parts in the slab before the last one
    bool beside_crossing(int j, int k) const;
    // Collects the cells over which surfaces with thin parts continue. Returns whether they are few enough.
    bool follow(int parts, FineRegion& out) const;

    const FieldView& field_;
    size_t columns_;
    std::vector<uint8_t> state_[3];  // of the cells of the last three slabs, with a border of one cell
    std::vector<Cell> mixed_[3];     // those in state kMixed
    int last_ = -1;                  // the last slab
    std::vector<Cell> crossing_;     // in order
    std::vector<Cell> thin_;         // with a surface between their corners, in order
    int shown_ = 1;                  // number of parts that show it, along each axis
};

}  // namespace edgegrad
