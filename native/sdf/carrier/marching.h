// Marching tetrahedra over the cells of a distance field, or over equal parts of them. Values at shared
// corners are the same, so that neighbouring cells leave no cracks.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "sdf/carrier/carrier.h"

namespace edgegrad {

using Cell = std::array<int, 3>;
using SkipCell = std::function<bool(const Cell&)>;
// `crosses`: the field has both signs at the corners of the cell.
using VisitCell = std::function<void(const Cell&, bool crosses)>;

// Adds the triangles of all cells that are not skipped; the field has the signs of its blocks. Visits those
// that may have the surface, in order.
void march_cells(const FieldView& field, const SkipCell& skips, const VisitCell& visit, FieldCarrier& out);

// Adds the triangles of some cells, in order, each of which is cut into `parts` along each axis.
void march_parts(const FieldView& field, const std::vector<Cell>& cells, int parts, FieldCarrier& out);

}  // namespace edgegrad
