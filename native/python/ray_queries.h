// Binding of the class that measures ray queries.
#pragma once

#include <nanobind/nanobind.h>

namespace edgegrad {

void bind_rays(nanobind::module_& module);

}  // namespace edgegrad
