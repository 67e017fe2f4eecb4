#include "shading/bsdf/bindings.h"

#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>

#include <stdexcept>

#include "column.h"
#include "dispatch.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace edgegrad {

namespace {

template <typename T>
struct Output {
    std::vector<T> values;
    size_t columns;
    explicit Output(size_t rows, size_t columns = 1) : values(rows * columns), columns(columns) {}
    nb::object array() const {
        T* copy = new T[values.size()];
        std::copy(values.begin(), values.end(), copy);
        const nb::capsule owner(copy, [](void* p) noexcept { delete[] static_cast<T*>(p); });
        const size_t rows = values.size() / columns;
        if (columns == 1) return nb::cast(nb::ndarray<nb::numpy, T, nb::ndim<1>>(copy, {rows}, owner));
        return nb::cast(nb::ndarray<nb::numpy, T, nb::ndim<2>>(copy, {rows, columns}, owner));
    }
};

// `materials` has kind, flags, params (core/material_table.py); fields of `points` as in BsdfTask.
nb::dict evaluate(nb::handle materials, nb::handle points, const std::string& instruction_set) {
    const auto kind = column<int32_t>(materials, "kind"), flags = column<int32_t>(materials, "flags");
    const auto rows = column<float>(materials, "params");
    const auto material = column<int32_t>(points, "material"),
               inside = column<int32_t>(points, "from_inside");
    const auto normal = column<float>(points, "normal"), true_normal = column<float>(points, "true_normal"),
               tangent = column<float>(points, "tangent"), wo = column<float>(points, "wo"),
               wi = column<float>(points, "wi"), random = column<float>(points, "random");
    const size_t n = material.size(), count = kind.size();
    bool fine = flags.size() == count && rows.size() == kMaterialParams * count && inside.size() == n;
    for (const auto* v : {&normal, &true_normal, &tangent, &wo, &wi, &random}) fine &= v->size() == 3 * n;
    for (int32_t k : material) fine &= k >= 0 && static_cast<size_t>(k) < count;
    if (!fine) throw std::invalid_argument("the points or materials of BSDFs have sizes that disagree");
    const BsdfTask task = {static_cast<int64_t>(n),
                           kind.data(),
                           flags.data(),
                           rows.data(),
                           material.data(),
                           inside.data(),
                           normal.data(),
                           true_normal.data(),
                           tangent.data(),
                           wo.data(),
                           wi.data(),
                           {random.data(), random.data() + n, random.data() + 2 * n}};
    Output<float> value(n, 3), pdf(n), emission(n, 3), sample_wi(n, 3), weight(n, 3), sample_pdf(n);
    Output<int32_t> active(n), specular(n), transmitted(n), ray_kind(n);
    const BsdfResult result = {value.values.data(),     pdf.values.data(),      emission.values.data(),
                               sample_wi.values.data(), weight.values.data(),   sample_pdf.values.data(),
                               active.values.data(),    specular.values.data(), transmitted.values.data(),
                               ray_kind.values.data()};
    {
        const nb::gil_scoped_release release;
        kernels(instruction_set).bsdfs(task, result);
    }
    nb::dict out;
    out["value"] = value.array();
    out["pdf"] = pdf.array();
    out["emission"] = emission.array();
    out["sample_wi"] = sample_wi.array();
    out["sample_weight"] = weight.array();
    out["sample_pdf"] = sample_pdf.array();
    out["sample_active"] = active.array();
    out["sample_specular"] = specular.array();
    out["sample_transmitted"] = transmitted.array();
    out["sample_ray_kind"] = ray_kind.array();
    return out;
}

}  // namespace

void bind_bsdfs(nb::module_& m) {
    m.def("evaluate_bsdfs", &evaluate, "materials"_a, "points"_a, "instruction_set"_a,
          "Evaluates and samples BSDFs at points.");
}

}  // namespace edgegrad
