// Which shaders let through a share of light that may change, so that derivatives need to know where shadow
// rays pass them (tasks/transparent_surfaces.h).
#pragma once

#include <vector>

#include "engine/derivative_tables.h"
#include "scene/view.h"

namespace edgegrad {

// TransparentClosure bits of each shader; empty if all are 0. `geometry`: places of surfaces change.
std::vector<int32_t> transparent_closures(const SceneView& scene, const SceneTables& tables,
                                          const Requested& requested, bool geometry);

}  // namespace edgegrad
