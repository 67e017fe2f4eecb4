// Shapes that occlude nothing, so that boundary terms may skip their edges.
#pragma once

#include "scene/tables.h"

namespace edgegrad {

// Whether all faces of a mesh are connected through shared edges.
bool is_connected(const SceneTables& tables, size_t mesh);

// Whether a closed, connected mesh bounds a convex body: all faces have an area and all edges are convex.
// Such a mesh occludes no part of itself, whether seen from outside or inside. `side` is the side that its
// faces look to (boundary/meshes/solids.h).
bool is_convex(const SceneTables& tables, size_t mesh, int8_t side, int threads);

// Whether a mesh is a flat sheet. Such a mesh occludes no part of itself.
bool is_flat(const SceneTables& tables, size_t mesh);

// Whether two meshes certainly neither intersect nor contain each other: their bounding boxes are disjoint or
// touch, or one mesh is flat and the other lies on one side of its plane.
bool are_apart(const SceneTables& tables, size_t one, size_t other);

}  // namespace edgegrad
