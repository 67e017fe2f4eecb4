// Finds closures whose transmittance may change. Derivatives record the transparent surfaces of such closures
// along shadow rays (tasks/records/transparent_surfaces.h).
#pragma once

#include <vector>

#include "engine/derivative_tables.h"
#include "scene/view.h"

namespace edgegrad {

// TransparentClosure bits of each closure; empty if all are 0. `geometry`: positions of surfaces change.
std::vector<int32_t> transparent_closures(const SceneView& scene, const SceneTables& tables,
                                          const Requested& requested, bool geometry);

}  // namespace edgegrad
