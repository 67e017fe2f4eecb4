// The outline of a distance field as a list of segments, which boundary terms sample.
#pragma once

#include <vector>

#include "sdf/carrier/carrier.h"
#include "sdf/outline_point.h"

namespace edgegrad {

// The outline of a field as segments (n, 2, 3) in the world. Their ends lie on the outline, are ordered as
// its tangent, and are shared by neighbours. Left out are parts where the viewer's rays come out of the
// surface, if no light travels inside.
std::vector<float> field_outline(const FieldView& field, const FieldCarrier& carrier,
                                 const FieldViewer& viewer, int threads);

}  // namespace edgegrad
