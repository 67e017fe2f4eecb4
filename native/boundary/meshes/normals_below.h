// Shading normals that point below their faces: where normals of far-off vertices are interpolated, or custom
// ones lean far to the side.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/tables.h"

namespace edgegrad {

// Of each material: whether the shading normal at some corner of its faces points below the face.
std::vector<uint8_t> normals_below(const SceneTables& tables, int threads);

}  // namespace edgegrad
