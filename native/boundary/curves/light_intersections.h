// Where meshes, and copies of instanced ones, pass through lights of the table: lines, each of a face and a
// light (kLightOfTable).
//
// Through rectangles and ellipses lines are straight, through spheres chords of the arcs that the faces'
// planes cut out of them (boundary/samples/light_cut.h bends them). Where a disk that faces what it lights is
// cut depends on that: its lines stand for faces that it may meet, and only their length means something.
// Planes that nearly lie in or touch a light are left out: the speed of their line has no bound.
#pragma once

#include <functional>

#include "boundary/curves/intersections.h"

namespace edgegrad {

// Those but for disks where one of the two moves, and those of `crossings` of which one face is in `emissive`
// (by face, -1: it gives no light; null: none does).
Intersections find_light_intersections(const SceneTables& tables, const RequestedMotion& motion,
                                       const Intersections& intersections, const int32_t* emissive,
                                       int threads);

// Those through disks, which turn with what they light.
Intersections find_disk_intersections(const SceneTables& tables, int threads);

// Those that camera rays meet and that may move in the picture. `disks`: also through these.
Intersections find_seen_lights(const SceneTables& tables, const RequestedMotion& motion, bool disks,
                               int threads);

// Those of the lights and meshes that requested(row, mesh) names.
using RequestedPair = std::function<bool(size_t row, size_t mesh)>;
Intersections lines_through_lights(const SceneTables& tables, const RequestedPair& requested, int threads);

}  // namespace edgegrad
