// Fields that light may travel in, as it does in glass: their outlines bound rays inside of them as well.
#pragma once

#include <cstdint>
#include <vector>

#include "boundary/curves/edge_cache.h"

namespace edgegrad {

// Whether a field's material lets light through, the field is negative at its box's borders, so that its
// inside is not closed, or the camera is inside.
bool light_may_be_inside(const SceneTables& tables, size_t field);

// The same for all fields, with what does not depend on the camera kept.
std::vector<uint8_t> lit_insides(const SceneTables& tables, EdgeCache& kept);

}  // namespace edgegrad
