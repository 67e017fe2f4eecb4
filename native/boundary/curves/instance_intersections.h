// Lines along which copies of instanced meshes pass through other surfaces, through each other, and through
// themselves.
#pragma once

#include "boundary/curves/intersections.h"
#include "boundary/meshes/face_tree.h"
#include "boundary/meshes/placed_vertex.h"

namespace edgegrad {

// A mesh where an instance places it, or that stands in the world itself (-1).
struct MeshCopy {
    int32_t mesh, instance;
    Placement place;
    Vector back[3];  // rows of the inverse of its linear part
    Box box;         // of its mesh's box in the world

    // `mesh_box`: of the mesh in its own space.
    MeshCopy(const SceneTables& tables, int32_t of_mesh, int32_t of_instance, const Box& mesh_box);
    // A point, and a box around what is in a box, in the mesh's own space.
    Vector local(Vector world) const;
    Box local(const Box& world) const;
};

// Appends a mesh's crossings with itself where its copies are.
void place_intersections(const SceneTables& tables, const Intersections& own,
                         const std::vector<int32_t>& copies, Intersections& out);

// Appends the crossings of different copies, and of copies with what stands in the world, of meshes that rays
// with one of `seers` meet, where one of the two moves, or the camera does.
void search_copies(const SceneTables& tables, const RequestedMotion& motion, int32_t seers, int threads,
                   Intersections& out);

}  // namespace edgegrad
