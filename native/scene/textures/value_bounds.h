// Bounds of the values that texture programs compute.
#pragma once

#include <cstddef>
#include <cstdint>

#include "scene/tables.h"

namespace edgegrad {

// A lower bound of a column of a closure's row over all shading points: the row's own value where no texture
// computes it, and minus infinity where nothing is known.
float least_value(const SceneTables& tables, size_t closure, int32_t column);

}  // namespace edgegrad
