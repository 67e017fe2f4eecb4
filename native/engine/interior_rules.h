// Where the interior term is zero, so that no path needs to be recorded, and which ones need to be where it
// isn't (core/planning/terms.py has the rules in words).
#pragma once

#include <vector>

#include "engine/derivative_tables.h"
#include "scene/requested_surfaces.h"
#include "scene/view.h"

namespace edgegrad {

// Whether nothing that is asked for changes any shading.
bool shading_is_constant(const SceneView& scene, const SceneTables& tables, const Requested& requested,
                         int max_depth);

// Whether rims of transmission lobes may move (path/rim.h).
bool rims_move(const SceneView& scene, const SceneTables& tables, const Requested& requested);

// Which surfaces have derivatives, where nothing else does. Emission is seen from everywhere, and shadows of
// what lets light through (`passed`, of engine/transparent_closures.h) are.
RequestedSurfaces requested_surfaces(const SceneView& scene, const SceneTables& tables,
                                     const Requested& requested, const std::vector<int32_t>& passed);

}  // namespace edgegrad
