// Light sampling as Python's tests call it.
#pragma once

#include <nanobind/nanobind.h>

#include "engine.h"

namespace edgegrad {

// Dictionaries of arrays; the arguments are described in light_probes.h.
nanobind::dict sample_lights(const Engine& engine, nanobind::handle position, nanobind::handle normal,
                             nanobind::handle u, nanobind::handle v, bool both_sides);
nanobind::dict meet_lights(const Engine& engine, nanobind::handle position, nanobind::handle normal,
                           nanobind::handle w, nanobind::handle face, nanobind::handle r,
                           nanobind::handle bsdf_pdf, int kind, bool both_sides);

}  // namespace edgegrad
