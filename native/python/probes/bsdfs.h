// Bindings of BSDFs.
#pragma once

#include <nanobind/nanobind.h>

namespace edgegrad {

void bind_bsdfs(nanobind::module_& m);

}  // namespace edgegrad
