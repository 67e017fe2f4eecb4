// The outline of a distance field as a list of segments, which boundary terms sample.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sdf/outline_point.h"
#include "sdf/surface_patch.h"

namespace edgegrad {

// A surface of triangles near that of a field, with about as many as the surface has cells: by marching
// tetrahedra, which leave no cracks. It guides the search for outlines. Outlines and parts of the surface
// that are smaller than a cell may be missed.
struct FieldCarrier {
    std::vector<double> point, gradient;  // (vertices, 3), in grid coordinates
    std::vector<uint32_t> triangle;       // (triangles, 3) vertices, counterclockwise as seen from outside
};
FieldCarrier field_carrier(const FieldView& field, int threads);
// Whether the surface may reach the faces of the field's box: not all coefficients that these read have one
// sign.
bool may_end_at_its_box(const FieldView& field);
FieldPatch field_patch(const FieldCarrier& carrier, std::size_t triangle);

// The outline of a field as segments (n, 2, 3) in the world. Their ends lie on the outline, are ordered as
// its tangent, and are shared by neighbours. Left out are parts where the viewer's rays come out of the
// surface, if no light travels inside.
std::vector<float> field_outline(const FieldView& field, const FieldCarrier& carrier,
                                 const FieldViewer& viewer, int threads);

}  // namespace edgegrad
