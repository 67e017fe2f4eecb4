#include "python/probes/probe_arrays.h"

#include <stdexcept>

#include "python/call.h"
#include "python/numpy_arrays.h"

namespace nb = nanobind;

namespace edgegrad {

nb::dict probe_backward(const ProbeTables& tables, nb::handle adjoint, size_t points, size_t outputs,
                        const ProbeKernel& kernel) {
    const InputArray<float> rows(adjoint, "adjoint",
                                 {static_cast<int64_t>(points), static_cast<int64_t>(outputs)});
    DifferentiableTables requested;
    std::vector<std::vector<double>> gradients;
    for (const ProbeTable& t : tables) {
        gradients.emplace_back(t.size);
        requested.add(t.data, t.size, 0, t.size, 1, 1, gradients.back().data(), nullptr);
    }
    without_interpreter([&] {
        TapeMemory memory;
        kernel({&requested, &memory, rows.data(), nullptr});
    });
    nb::dict out;
    for (size_t k = 0; k < tables.size(); ++k)
        out[tables[k].name] = to_numpy(gradients[k], {gradients[k].size()});
    return out;
}

nb::object probe_forward(const ProbeTables& tables, nb::handle tangents, size_t points, size_t outputs,
                         const ProbeKernel& kernel) {
    DifferentiableTables requested;
    std::vector<std::vector<double>> given;
    for (const ProbeTable& t : tables) {
        given.push_back(column<double>(tangents, t.name));
        if (given.back().size() != t.size)
            throw std::invalid_argument(std::string("the tangent of '") + t.name +
                                        "' has another size than the table");
        requested.add(t.data, t.size, 0, t.size, 1, 1, nullptr, given.back().data());
    }
    std::vector<float> out(points * outputs);
    without_interpreter([&] {
        TapeMemory memory;
        kernel({&requested, &memory, nullptr, out.data()});
    });
    return to_numpy(out, {points, outputs});
}

}  // namespace edgegrad
