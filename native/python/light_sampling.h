// Light sampling as Python's tests call it.
#pragma once

#include <nanobind/nanobind.h>

#include "engine/engine.h"

namespace edgegrad {

// Dictionaries of arrays; the arguments are described in tasks/light_probe_task.h.
nanobind::dict sample_lights(const Engine& engine, nanobind::handle position, nanobind::handle normal,
                             nanobind::handle u, nanobind::handle v, bool both_sides);
nanobind::dict meet_lights(const Engine& engine, nanobind::handle position, nanobind::handle normal,
                           nanobind::handle w, nanobind::handle face, nanobind::handle r,
                           nanobind::handle bsdf_pdf, int kind, bool both_sides);

// Samples for (u, v), and what is seen along given directions.
nanobind::dict sample_environment_light(const Engine& engine, nanobind::handle u, nanobind::handle v);
nanobind::dict look_at_environment(const Engine& engine, nanobind::handle w);

}  // namespace edgegrad
