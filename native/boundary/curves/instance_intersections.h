// The lines along which instances intersect themselves, each other and other surfaces.
#pragma once

#include <span>

#include "boundary/curves/intersections.h"
#include "boundary/meshes/face_tree.h"
#include "boundary/meshes/placed_vertex.h"

namespace edgegrad {

// A mesh placed by an instance, or a mesh that is not instanced (instance -1).
struct PlacedMesh {
    int32_t mesh, instance;
    Placement place;
    Vector back[3];  // rows of the inverse of the transform's linear part
    Box box;         // bounds in the world

    // `mesh_box` is the mesh's bounding box in its own space.
    PlacedMesh(const SceneTables& tables, int32_t of_mesh, int32_t of_instance, const Box& mesh_box);
    // A point in the mesh's own space, and the bounds there of a box.
    Vector local(Vector world) const;
    Box local(const Box& world) const;
};

// Appends a mesh's intersections with itself, once for each of its instances.
void place_intersections(const SceneTables& tables, const Intersections& own,
                         std::span<const int32_t> instances, Intersections& out);

// Appends the intersections of instances with each other and with meshes that are not instanced. Considered
// are pairs of which one moves, or all pairs if the camera moves, of meshes visible to rays of `seers`.
void search_instances(const SceneTables& tables, const RequestedMotion& motion, int32_t seers, int threads,
                      Intersections& out);

}  // namespace edgegrad
