// The triangles of a tiny scene, prepared for testing every ray against all of them
// (scene/rays/brute_force.h).
#pragma once

#include <vector>

#include "scene/rays/brute_triangle.h"

namespace edgegrad {

struct GeometryTables;

// The triangles that rays can hit, the largest first. Empty if there are too many, or instances.
std::vector<BruteTriangle> brute_triangles(const GeometryTables& tables);

// All triangles, whatever their number.
std::vector<BruteTriangle> all_brute_triangles(const GeometryTables& tables);

}  // namespace edgegrad
