// The part of the picture in which mirrors and smooth glass are seen. Scan lines
// (boundary/specular/scan_lines.h) search only there.
#pragma once

#include "scene/tables.h"

namespace edgegrad {

// A rectangle of the film, pixels of the frame.
struct FilmRectangle {
    float low[2], high[2];

    bool empty() const { return !(low[0] < high[0] && low[1] < high[1]); }
};

// Bounds of the region in which camera rays may meet a mirror or smooth glass as their first scattering
// surface, including the pixel filter's support.
FilmRectangle specular_bounds(const SceneView& scene, const SceneTables& tables);

}  // namespace edgegrad
