// Binding of what the gradients of a view have learned.
#include "python/bindings.h"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <type_traits>
#include <vector>

#include "boundary/curves/learned_weights.h"
#include "python/numpy_arrays.h"

namespace nb = nanobind;

namespace edgegrad {
namespace {

void read_by_term(nb::handle values, double (&out)[kDerivativeTerms]) {
    double read[kDerivativeTerms];
    for (int k = 0; k < kDerivativeTerms; ++k) read[k] = nb::cast<double>(values[k]);
    std::copy(std::begin(read), std::end(read), out);
}

// Adds a member of LearnedWeights to a dictionary, and reads it from there.
struct ToPython {
    nb::dict& out;
    template <typename T>
    void operator()(const char* name, const std::vector<T>& values) const {
        out[name] = to_numpy(values, {values.size()});
    }
    template <typename T, size_t rows, size_t columns>
    void operator()(const char* name, const T (&values)[rows][columns]) const {
        const OutputArray<T> array({rows, columns});
        std::copy_n(&values[0][0], rows * columns, array.data());
        out[name] = array.array();
    }
    template <typename T, typename = std::enable_if_t<std::is_arithmetic_v<T>>>
    void operator()(const char* name, const T& value) const {
        out[name] = value;
    }
};

struct FromPython {
    nb::handle given;
    template <typename T>
    void operator()(const char* name, std::vector<T>& values) const {
        values = InputArray<T>(given[name], name, {-1}).copy();
    }
    template <typename T, size_t rows, size_t columns>
    void operator()(const char* name, T (&values)[rows][columns]) const {
        const InputArray<T> array(given[name], name,
                                  {static_cast<int64_t>(rows), static_cast<int64_t>(columns)});
        std::copy_n(array.data(), rows * columns, &values[0][0]);
    }
    template <typename T, typename = std::enable_if_t<std::is_arithmetic_v<T>>>
    void operator()(const char* name, T& value) const {
        value = nb::cast<T>(given[name]);
    }
};

nb::dict state(const LearnedSampling& learned) {
    nb::list weights;
    for (const LearnedWeights& of_kind : learned.weights) {
        nb::dict members;
        LearnedWeights::members(of_kind, ToPython{members});
        weights.append(members);
    }
    nb::dict out;
    out["weights"] = weights;
    out["share"] = to_list(learned.share);
    out["taken"] = to_list(learned.taken);
    return out;
}

void restore(LearnedSampling& learned, nb::handle given) {
    LearnedSampling read;
    const nb::handle weights = given["weights"];
    if (nb::len(weights) != kBoundaryKinds)
        throw std::invalid_argument("the learned sampling has other terms");
    for (size_t k = 0; k < kBoundaryKinds; ++k) {
        const nb::object members = weights[k];
        LearnedWeights::members(read.weights[k], FromPython{members});
        if (!read.weights[k].is_consistent())
            throw std::invalid_argument("the arrays of the learned sampling do not fit together");
    }
    read_by_term(given["share"], read.share);
    read_by_term(given["taken"], read.taken);
    learned = std::move(read);
}

}  // namespace

void bind_learned_sampling(nb::module_& module) {
    nb::class_<LearnedSampling>(module, "LearnedSampling",
                                "What gradients of one view have learned; shares and samples are by term.")
        .def(nb::init<>())
        .def_prop_rw(
            "share", [](const LearnedSampling& l) { return to_list(l.share); },
            [](LearnedSampling& l, nb::handle share) { read_by_term(share, l.share); })
        .def_prop_ro("taken", [](const LearnedSampling& l) { return to_list(l.taken); })
        .def("state", &state, "Everything that is stored, as numbers and arrays.")
        .def("restore", &restore, nb::arg("state"), "Takes what `state` has returned.");
}

}  // namespace edgegrad
