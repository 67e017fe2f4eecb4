// Regions of continuous shading. Scan lines (boundary/specular/scan_lines.h) use them to decide whether two
// neighbouring rays see the same surface.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/tables.h"

namespace edgegrad {

struct SurfaceRegions {
    std::vector<int32_t> region;     // of each face
    std::vector<int32_t> face_edge;  // (F, 3): an edge opposite to each corner, or -1
    // Of each edge: the next edge in the ring of all that lie on one side of a face. Faces may have several
    // edges on a side (core/geometry/collinear.py). Empty: no face has.
    std::vector<int32_t> next_on_side;
    std::vector<uint8_t> continues;  // of each edge: shading_continues
};

// Two faces of a visible mesh belong to one region if a chain of edges without a discontinuity joins them: at
// each edge the faces share a material, share the shading normals of their common corners or lie in one
// plane, and the edge is no seam.
SurfaceRegions surface_regions(const SceneTables& tables);

// Whether shading is continuous across an edge.
bool shading_continues(const SceneTables& tables, size_t edge);

}  // namespace edgegrad
