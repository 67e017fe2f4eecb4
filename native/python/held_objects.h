// Which of very many Python objects have not been touched since they were last looked at.
#pragma once

#include <nanobind/nanobind.h>

namespace edgegrad {

// Adds HeldObjects to the module.
void bind_held_objects(nanobind::module_& module);

}  // namespace edgegrad
