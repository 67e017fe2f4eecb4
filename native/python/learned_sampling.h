// Binding of what the gradients of a view have learned.
#pragma once

#include <nanobind/nanobind.h>

namespace edgegrad {

void bind_learned_sampling(nanobind::module_& module);

}  // namespace edgegrad
