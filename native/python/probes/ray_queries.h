// Binding of the class that measures ray queries.
#pragma once

#include <nanobind/nanobind.h>

#include "engine/engine.h"

namespace edgegrad {

// Traces rays against a whole scene: (n,) faces, -1 without a hit, and distances.
nanobind::tuple trace_rays(const Engine& engine, nanobind::handle origins, nanobind::handle directions,
                           float far, bool shadow);

void bind_rays(nanobind::module_& module);

}  // namespace edgegrad
