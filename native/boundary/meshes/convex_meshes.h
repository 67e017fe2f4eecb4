// Shapes that hide nothing: no derivative of a boundary comes of them.
#pragma once

#include "scene/tables.h"

namespace edgegrad {

// Whether all faces of a mesh hang together through edges.
bool is_connected(const SceneTables& tables, size_t mesh);

// Whether a closed and connected mesh bounds a convex body: all of its faces have an area, and all of its
// edges are convex. It hides nothing of itself then, neither outside nor inside. `side`: to which its faces
// look (boundary/meshes/solids.h).
bool is_convex(const SceneTables& tables, size_t mesh, int8_t side, int threads);

// Whether a mesh is a flat sheet: it hides nothing of itself then, on either side.
bool is_flat(const SceneTables& tables, size_t mesh);

// Whether two meshes certainly neither pass through each other nor hold each other: their bounds are apart or
// touch, or one is flat and the other on one side of its plane.
bool are_apart(const SceneTables& tables, size_t one, size_t other);

}  // namespace edgegrad
