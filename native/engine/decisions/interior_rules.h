// Which paths the interior term records, and which of its parts are computed. Where the whole term is zero:
// engine/decisions/shading_rules.h.
#pragma once

#include <vector>

#include "engine/decisions/decisions.h"
#include "engine/derivative_tables.h"
#include "scene/requested_surfaces.h"
#include "scene/view.h"

namespace edgegrad {

// Whether a material scatters no light.
bool is_black(const SceneView& scene, int32_t material);
// Whether all visible surfaces scatter no light. They may emit.
bool all_black(const SceneView& scene, const SceneTables& tables);

// Whether rims of lobes may move (path/rim.h).
bool rims_move(const SceneView& scene, const SceneTables& tables, const Requested& requested);
// The rims that some light may meet: none, those of lit gloss alone, or others, too.
enum class Rims { kNone, kOfGloss, kAll };
Rims rims_that_count(const SceneView& scene, const SceneTables& tables);

// Whether the densities of samples of lights and lobes may change. Where some kinds of rays alone can hit a
// mesh, the picture depends on them.
bool changes_densities(const Requested& requested);

// Whether the width of a closure's lobes is requested, or where they point.
bool shapes_lobes(const Requested& requested, size_t closure);

// The surfaces that have derivatives, if nothing else does. With requested emission, or requested
// transmittance (`passed`, see engine/decisions/transparent_closures.h), light everywhere has derivatives.
RequestedSurfaces requested_surfaces(const SceneView& scene, const SceneTables& tables,
                                     const Requested& requested, const std::vector<int32_t>& passed);

}  // namespace edgegrad
