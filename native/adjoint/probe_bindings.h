// Derivatives of probes between numpy and the kernels: gradients of all tables by name, or one tangent.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <functional>
#include <string>
#include <vector>

#include "kernels.h"

namespace edgegrad {

// Of every output, one row per point.
using Adjoint = nanobind::ndarray<const float, nanobind::ndim<2>, nanobind::c_contig, nanobind::device::cpu>;

struct ProbeTable {
    const char* name;
    const float* data;
    size_t size;
    ProbeTable(const char* name, const std::vector<float>& v) : ProbeTable(name, v.data(), v.size()) {}
    ProbeTable(const char* name, const float* data, size_t size) : name(name), data(data), size(size) {}
};
using ProbeTables = std::vector<ProbeTable>;
using ProbeKernel = std::function<void(const ProbeSweep&)>;

// Gradients (float64, flat) by the tables' names.
nanobind::dict probe_backward(const ProbeTables& tables, const Adjoint& adjoint, size_t points,
                              size_t outputs, const ProbeKernel& kernel);

// Tangents (float64) are attributes of `tangents` with the tables' names; of the outputs (points, outputs).
nanobind::object probe_forward(const ProbeTables& tables, nanobind::handle tangents, size_t points,
                               size_t outputs, const ProbeKernel& kernel);

template <typename T>
nanobind::object to_numpy(std::vector<T>&& values, std::vector<size_t> shape) {
    auto* held = new std::vector<T>(std::move(values));
    const nanobind::capsule owner(held, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
    return nanobind::cast(
        nanobind::ndarray<nanobind::numpy, T>(held->data(), shape.size(), shape.data(), owner));
}

// Adds the probes of parts that read a scene to the module.
void bind_scene_probes(nanobind::module_& module);

}  // namespace edgegrad
