// Derivatives of probes between NumPy and the kernels: gradients of all tables by name, or one tangent.
#pragma once

#include <nanobind/nanobind.h>

#include <functional>
#include <vector>

#include "tasks/probe_tasks.h"

namespace edgegrad {

struct ProbeTable {
    const char* name;
    const float* data;
    size_t size;
    ProbeTable(const char* name, const std::vector<float>& v) : ProbeTable(name, v.data(), v.size()) {}
    ProbeTable(const char* name, const float* data, size_t size) : name(name), data(data), size(size) {}
};
using ProbeTables = std::vector<ProbeTable>;
using ProbeKernel = std::function<void(const ProbeSweep&)>;

// Returns gradients (float64, flat) by the tables' names. `adjoint`: float32, one row of all outputs per
// point.
nanobind::dict probe_backward(const ProbeTables& tables, nanobind::handle adjoint, size_t points,
                              size_t outputs, const ProbeKernel& kernel);

// Returns the outputs' tangents (points, outputs). Attributes of `tangents` (float64) have the tables' names.
nanobind::object probe_forward(const ProbeTables& tables, nanobind::handle tangents, size_t points,
                               size_t outputs, const ProbeKernel& kernel);

}  // namespace edgegrad
