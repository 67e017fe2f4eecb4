// BSDFs as Python may look at them.
#pragma once

#include <nanobind/nanobind.h>

namespace edgegrad {

void bind_bsdfs(nanobind::module_& m);

}  // namespace edgegrad
