// Where in the picture mirrors and smooth glass are seen: scan lines (boundary/specular/scan_lines.h) look
// nowhere else.
#pragma once

#include "scene/tables.h"

namespace edgegrad {

// A part of the film, pixels of the frame.
struct FilmRectangle {
    float low[2], high[2];

    bool empty() const { return !(low[0] < high[0] && low[1] < high[1]); }
};

// Bounds of where camera rays may meet a mirror or smooth glass before anything else bends them, within what
// the pixel filters see.
FilmRectangle specular_bounds(const SceneView& scene, const SceneTables& tables);

}  // namespace edgegrad
