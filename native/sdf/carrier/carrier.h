// The carrier of a distance field: triangles near its surface, by marching tetrahedra, which leave no cracks.
// It guides the search for outlines and for points of the surface. There are about as many triangles as cells
// with the surface. Where a part of the surface is thinner than a cell, smaller triangles cover it
// (sdf/carrier/thin_parts.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sdf/field_view.h"
#include "sdf/surface_patch.h"

namespace edgegrad {

struct FieldCarrier {
    std::vector<double> point, gradient;  // (vertices, 3), in grid coordinates
    std::vector<uint32_t> triangle;       // (triangles, 3) vertices, counterclockwise as seen from outside
    bool complete = true;                 // no part of the surface is known to be missing
};
// Reads the coefficients near the surface alone if the view has the signs of its blocks.
FieldCarrier field_carrier(const FieldView& view, int threads);
FieldPatch field_patch(const FieldCarrier& carrier, std::size_t triangle);

// Whether the surface may reach the faces of the field's box: not all coefficients that these read have one
// sign.
bool may_end_at_its_box(const FieldView& field);

}  // namespace edgegrad
