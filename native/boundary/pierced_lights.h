// Where meshes pass through lights.
#pragma once

#include <functional>

#include "boundary/crossings.h"

namespace edgegrad {

// Lines along which meshes pass through lights of the table, each as a face and a light (kLightOfTable):
// through rectangles and ellipses straight ones, through spheres chords of the arcs that the faces' planes
// cut out of them (boundary/light_cut.h bends them). Where a disk that faces what it lights is cut depends on
// that: its lines stand for faces that it may meet, and only their length means something. `wanted`: of rows
// of the table and meshes. Instances are left out, and so are planes that nearly lie in or touch a light: the
// speed of their line has no bound.
using WantedPair = std::function<bool(size_t row, size_t mesh)>;
Crossings lines_through_lights(const SceneTables& tables, const WantedPair& wanted, int threads);

// Those but for disks where one of the two moves, and those of `crossings` of which one face is in `emissive`
// (by face, -1: it gives no light; null: none does).
Crossings find_pierced_lights(const SceneTables& tables, const Asked& asked, const Crossings& crossings,
                              const int32_t* emissive, int threads);

// Those through disks, which turn with what they light.
Crossings find_pierced_disks(const SceneTables& tables, int threads);

// Those that camera rays meet and that may move in the picture. `disks`: also through these.
Crossings find_seen_lights(const SceneTables& tables, const Asked& asked, bool disks, int threads);

}  // namespace edgegrad
