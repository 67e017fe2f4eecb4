#include "adjoint/probe_bindings.h"

#include <stdexcept>

#include "column.h"

namespace nb = nanobind;

namespace edgegrad {

namespace {

template <typename T>
nb::object to_numpy(std::vector<T>&& values, std::vector<size_t> shape) {
    auto* held = new std::vector<T>(std::move(values));
    const nb::capsule owner(held, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
    return nb::cast(nb::ndarray<nb::numpy, T>(held->data(), shape.size(), shape.data(), owner));
}

}  // namespace

nb::dict probe_backward(const ProbeTables& tables, const Adjoint& adjoint, size_t points, size_t outputs,
                        const ProbeKernel& kernel) {
    if (adjoint.shape(0) != points || adjoint.shape(1) != outputs)
        throw std::invalid_argument("the adjoint must have one row per point with all outputs");
    DifferentiableTables asked;
    std::vector<std::vector<double>> gradients;
    for (const auto& [name, values] : tables) {
        gradients.emplace_back(values->size());
        asked.add(values->data(), values->size(), 0, values->size(), gradients.back().data(), nullptr);
    }
    {
        const nb::gil_scoped_release release;
        TapeMemory memory;
        kernel({&asked, &memory, adjoint.data(), nullptr});
    }
    nb::dict out;
    for (size_t k = 0; k < tables.size(); ++k) {
        const size_t size = gradients[k].size();
        out[tables[k].first] = to_numpy(std::move(gradients[k]), {size});
    }
    return out;
}

nb::object probe_forward(const ProbeTables& tables, nb::handle tangents, size_t points, size_t outputs,
                         const ProbeKernel& kernel) {
    DifferentiableTables asked;
    std::vector<std::vector<double>> given;
    for (const auto& [name, values] : tables) {
        given.push_back(column<double>(tangents, name));
        if (given.back().size() != values->size())
            throw std::invalid_argument(std::string("the tangent of '") + name +
                                        "' has another size than the table");
        asked.add(values->data(), values->size(), 0, values->size(), nullptr, given.back().data());
    }
    std::vector<float> out(points * outputs);
    {
        const nb::gil_scoped_release release;
        TapeMemory memory;
        kernel({&asked, &memory, nullptr, out.data()});
    }
    return to_numpy(std::move(out), {points, outputs});
}

}  // namespace edgegrad
