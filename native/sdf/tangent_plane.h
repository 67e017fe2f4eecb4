// The surface of a field at a hit, as a triangle: what all code that reads a hit of a mesh then works with.
#pragma once

#include "sdf/field_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// The triangle in the tangent plane whose first corner is the place that `code` stands for
// (sdf/place_code.h), pulled onto the surface. Its front is where the field is positive. It is so large that
// rays which leave it (scene/geometry.h, ray_offset) clear the rounding of the field.
void tangent_triangle(const FieldView& field, const uint32_t (&code)[2], float (&corners)[3][3]);

}  // namespace edgegrad::EDGEGRAD_ISA
