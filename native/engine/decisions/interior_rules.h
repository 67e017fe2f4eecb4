// Where the interior term is zero, so that no path needs to be recorded, and which ones need to be where it
// isn't (core/planning/interior.py has the rules in words).
#pragma once

#include <vector>

#include "engine/decisions/decisions.h"
#include "engine/derivative_tables.h"
#include "scene/requested_surfaces.h"
#include "scene/view.h"

namespace edgegrad {

// Why nothing that is requested changes any shading; kNeeded: something may.
Reason constant_shading(const SceneView& scene, const SceneTables& tables, const Requested& requested,
                        int max_depth);

// Whether a material scatters no light.
bool is_black(const SceneView& scene, int32_t material);
// Whether all visible surfaces are black: they may give light, and scatter none.
bool all_black(const SceneView& scene, const SceneTables& tables);

// Whether rims of transmission lobes may move (path/rim.h).
bool rims_move(const SceneView& scene, const SceneTables& tables, const Requested& requested);

// Which surfaces have derivatives, where nothing else does. Emission is seen from everywhere, and shadows of
// what lets light through (`passed`, of engine/decisions/transparent_closures.h) are.
RequestedSurfaces requested_surfaces(const SceneView& scene, const SceneTables& tables,
                                     const Requested& requested, const std::vector<int32_t>& passed);

}  // namespace edgegrad
