// Derivatives of probes between numpy and the kernels: gradients of all tables by name, or one tangent.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "kernels.h"

namespace edgegrad {

// Of every output, one row per point.
using Adjoint = nanobind::ndarray<const float, nanobind::ndim<2>, nanobind::c_contig, nanobind::device::cpu>;

using ProbeTables = std::vector<std::pair<const char*, const std::vector<float>*>>;
using ProbeKernel = std::function<void(const ProbeSweep&)>;

// Gradients (float64, flat) by the tables' names.
nanobind::dict probe_backward(const ProbeTables& tables, const Adjoint& adjoint, size_t points,
                              size_t outputs, const ProbeKernel& kernel);

// Tangents (float64) are attributes of `tangents` with the tables' names; of the outputs (points, outputs).
nanobind::object probe_forward(const ProbeTables& tables, nanobind::handle tangents, size_t points,
                               size_t outputs, const ProbeKernel& kernel);

}  // namespace edgegrad
