// The lines along which meshes, and the copies that instances place, intersect themselves and each other.
#pragma once

#include <span>

#include "boundary/curves/intersections.h"
#include "boundary/meshes/trees/mesh_trees.h"

namespace edgegrad {

// Appends a mesh's intersections with itself, once for each of its instances.
void place_intersections(const SceneTables& tables, const Intersections& own,
                         std::span<const int32_t> instances, Intersections& out);

// Appends the intersections of different meshes and of copies of meshes. Considered are pairs of which one
// moves, or all pairs if the camera moves, of meshes visible to rays of `seers`. `boxes` and `trees` are
// those of the meshes.
void search_pairs(const SceneTables& tables, const MeshBoxes& boxes, const MeshTrees& trees,
                  const RequestedMotion& motion, int32_t seers, int threads, Intersections& out);

}  // namespace edgegrad
