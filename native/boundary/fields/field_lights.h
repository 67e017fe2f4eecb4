// Distance fields whose surfaces pass through lights of the light table.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "boundary/curves/edge_cache.h"
#include "boundary/curves/light_intersections.h"

namespace edgegrad {

// Pairs of a light's row and the mesh that stands for a field that passes through the light, of those that
// requested(row, mesh) names. Disks count in all of their orientations.
std::vector<std::array<int32_t, 2>> fields_through_lights(const SceneTables& tables, EdgeCache& kept,
                                                          int threads, const RequestedPair& requested);

}  // namespace edgegrad
