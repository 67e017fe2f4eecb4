// Convex polygons that coplanar faces form, as the two triangles of a quad or the cells of a grid.
#pragma once

#include <cstdint>
#include <vector>

#include "boundary/meshes/surface_regions.h"
#include "scene/tables.h"

namespace edgegrad {

struct CoplanarPolygons {
    std::vector<int32_t> face;   // (F) the polygon of each face, or -1; empty: there are no polygons
    std::vector<int32_t> sides;  // (P, kPolygonSides, 2) ends of the sides, counter-clockwise; -1: no side
};

// The polygons of all regions of flat faces (boundary/meshes/surface_regions.h) that are convex and have at
// most kPolygonSides sides.
CoplanarPolygons coplanar_polygons(const SceneTables& tables, const SurfaceRegions& regions);

}  // namespace edgegrad
