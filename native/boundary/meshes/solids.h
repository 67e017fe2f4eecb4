// Which meshes are solid bodies seen from outside: what lies inside them is hardly ever seen.
#pragma once

#include "scene/tables.h"

namespace edgegrad {

// Whether each visible mesh is closed: every edge has two faces, wound in opposite directions along it.
std::vector<uint8_t> closed_meshes(const SceneTables& tables);

// A mesh that is a solid body, as far as its vertices tell.
struct SolidBody {
    int8_t side = 0;  // its faces look to: +1 outwards, -1 inwards (signed volume); 0: it isn't closed
    float low[3] = {}, high[3] = {};
};

// By mesh; instanced ones have no side.
std::vector<SolidBody> solid_bodies(const SceneTables& tables, const std::vector<uint8_t>& closed,
                                    int threads);

// The sides of those that the camera sees from outside; 0 of those whose bounds reach around the camera or to
// its near plane. Exact for a convex body; else a hint for the distribution of samples: where a mesh crosses
// itself and so turns parts of itself inside out, it costs noise, not truth.
std::vector<int8_t> solid_sides(const std::vector<SolidBody>& bodies, const CameraView& camera);

}  // namespace edgegrad
