// The lines along which instances intersect themselves, each other and other surfaces.
#pragma once

#include <span>

#include "boundary/curves/intersections.h"
#include "boundary/meshes/placement.h"

namespace edgegrad {

// Appends a mesh's intersections with itself, once for each of its instances.
void place_intersections(const SceneTables& tables, const Intersections& own,
                         std::span<const int32_t> instances, Intersections& out);

// Appends the intersections of instances with each other and with meshes that are not instanced. Considered
// are pairs of which one moves, or all pairs if the camera moves, of meshes visible to rays of `seers`.
void search_instances(const SceneTables& tables, const RequestedMotion& motion, int32_t seers, int threads,
                      Intersections& out);

}  // namespace edgegrad
