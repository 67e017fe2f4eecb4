// Bindings of light sampling, for tests.
#pragma once

#include <nanobind/nanobind.h>

#include "engine/engine.h"

namespace edgegrad {

// Return dictionaries of arrays. tasks/light_probe_task.h describes the arguments.
nanobind::dict sample_lights(const Engine& engine, nanobind::handle position, nanobind::handle normal,
                             nanobind::handle u, nanobind::handle v, bool both_sides);
nanobind::dict meet_lights(const Engine& engine, nanobind::handle position, nanobind::handle normal,
                           nanobind::handle w, nanobind::handle face, nanobind::handle r,
                           nanobind::handle bsdf_pdf, int kind, bool both_sides);

// Samples for (u, v), and the environment seen along given directions.
nanobind::dict sample_environment_light(const Engine& engine, nanobind::handle u, nanobind::handle v);
nanobind::dict look_at_environment(const Engine& engine, nanobind::handle w);

}  // namespace edgegrad
