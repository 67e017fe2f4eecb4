// Parts of surfaces over which shading is continuous, by which scan lines tell whether two neighbouring rays
// see the same (boundary/specular/scan_lines.h).
#pragma once

#include <cstdint>
#include <vector>

#include "scene/tables.h"

namespace edgegrad {

struct SurfaceRegions {
    std::vector<int32_t> region;     // of each face
    std::vector<int32_t> face_edge;  // (F, 3) the edge opposite of each corner; -1: none is known
};

// Faces of the visible meshes are of one region if they are joined by edges across which nothing jumps: two
// faces of one material that share their corners' shading normals or lie in one plane, and no seam.
SurfaceRegions surface_regions(const SceneTables& tables);

}  // namespace edgegrad
