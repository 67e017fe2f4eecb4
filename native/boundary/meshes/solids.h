// Meshes that are solid bodies seen from outside. The camera hardly ever sees what lies inside them.
#pragma once

#include "scene/tables.h"

namespace edgegrad {

// Whether each visible mesh is closed: every edge has two faces, wound in opposite directions along the edge.
std::vector<uint8_t> closed_meshes(const SceneTables& tables);

// The orientation and the bounds of a mesh that is a solid body.
struct SolidBody {
    int8_t side = 0;  // +1: faces look outwards, -1: inwards (sign of the volume), 0: not closed
    float low[3] = {}, high[3] = {};
};

// By mesh. Instanced meshes get no side.
std::vector<SolidBody> solid_bodies(const SceneTables& tables, const std::vector<uint8_t>& closed,
                                    int threads);

// By mesh: the side of each body that the camera sees from outside. 0 if the bounds contain the camera or
// reach the near plane. For a convex body the side is exact. For others it only guides sampling: a mesh that
// intersects itself has parts turned inside out, which adds variance but no bias.
std::vector<int8_t> solid_sides(const std::vector<SolidBody>& bodies, const CameraView& camera);

}  // namespace edgegrad
