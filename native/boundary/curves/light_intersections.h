// Intersections of meshes and instances with lights of the light table: lines, each of a face and a light
// (kLightOfTable).
//
// Rectangles and ellipses are intersected along straight lines. A sphere's line is the chord of an arc, the
// intersection with the face's plane (boundary/samples/light_cut.h bends it back). A disk faces the point
// that it lights, so its intersection depends on that point: its lines only list the faces that it may meet,
// and only their length has a meaning. Planes that nearly contain or touch a light are left out, because the
// velocity of their line is unbounded.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>

#include "boundary/curves/intersections.h"
#include "boundary/meshes/face_cut.h"

namespace edgegrad {

// Intersections with all lights but disks where one of the two moves, and those of `intersections` with an
// emissive face. `emissive` is -1 for faces that emit no light, and null if none does.
Intersections find_light_intersections(const SceneTables& tables, const RequestedMotion& motion,
                                       const Intersections& intersections, const int32_t* emissive,
                                       int threads);

// Intersections with disks, which turn with the point that they light.
Intersections find_disk_intersections(const SceneTables& tables, int threads);

// Intersections that the camera sees and that may move in the picture. `disks`: include disks.
Intersections find_seen_lights(const SceneTables& tables, const RequestedMotion& motion, bool disks,
                               int threads);

// Those of the lights and meshes that requested(row, mesh) names.
using RequestedPair = std::function<bool(size_t row, size_t mesh)>;
Intersections lines_through_lights(const SceneTables& tables, const RequestedPair& requested, int threads);

// Pairs of a rectangle's or an ellipse's row and a mesh that has a face in its plane and on it.
std::vector<std::array<int32_t, 2>> lights_on_faces(const SceneTables& tables, const RequestedPair& requested,
                                                    int threads);

// The box of a light with a size; that of a disk contains it in all of its orientations. Null: other lights.
std::optional<Box> box_of_light(const SceneTables& tables, size_t row);
// Whether some of the triangles pass through such a light.
bool any_through_light(const SceneTables& tables, size_t row, std::span<const Triangle3> surface);

}  // namespace edgegrad
