// Where the interior term is zero, so that no path needs to be recorded (core/derivative_plan.py has the
// rules in words).
#pragma once

#include "derivative_tables.h"
#include "scene/view.h"

namespace edgegrad {

// Whether nothing that is asked for changes any shading.
bool shading_is_constant(const SceneView& scene, const SceneTables& tables, const Wanted& wanted,
                         int max_depth);

}  // namespace edgegrad
