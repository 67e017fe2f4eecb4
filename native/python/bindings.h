// What module.cpp adds to the module: each file beside it binds its own functions and classes.
#pragma once

#include <nanobind/nanobind.h>

namespace edgegrad {

void bind_held_objects(nanobind::module_& m);
void bind_learned_sampling(nanobind::module_& m);
void bind_mesh_arrays(nanobind::module_& m);

// For tests and measurements (native/python/probes/).
void bind_bsdfs(nanobind::module_& m);
void bind_fields(nanobind::module_& m);
void bind_scene_probes(nanobind::module_& m);

}  // namespace edgegrad
