// Bindings of BSDFs.
#include "python/bindings.h"

#include <stdexcept>

#include "kernels/dispatch.h"
#include "python/call.h"
#include "python/numpy_arrays.h"
#include "python/probes/probe_arrays.h"
#include "tasks/kernel_table.h"
#include "tasks/probe_tasks.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace edgegrad {

namespace {

template <typename T>
struct Output {
    std::vector<T> values;
    size_t columns;
    explicit Output(size_t rows, size_t columns = 1) : values(rows * columns), columns(columns) {}
    nb::object array() const { return rows_to_numpy(values, columns); }
};

// `materials` has kind, flags and params (core/tables/materials.py); the fields of `points` are those of
// BsdfTask.
class Points {
 public:
    Points(nb::handle materials, nb::handle points)
        : kind_(column<int32_t>(materials, "kind")),
          flags_(column<int32_t>(materials, "flags")),
          material_(column<int32_t>(points, "material")),
          inside_(column<int32_t>(points, "from_inside")),
          rows(column<float>(materials, "params")),
          normal(column<float>(points, "normal")),
          true_normal(column<float>(points, "true_normal")),
          tangent(column<float>(points, "tangent")),
          wo(column<float>(points, "wo")),
          wi(column<float>(points, "wi")),
          random(column<float>(points, "random")) {
        const size_t n = material_.size(), count = kind_.size();
        bool fine = flags_.size() == count && rows.size() == kMaterialParams * count && inside_.size() == n;
        for (const auto* v : {&normal, &true_normal, &tangent, &wo, &wi, &random}) fine &= v->size() == 3 * n;
        for (int32_t k : material_) fine &= k >= 0 && static_cast<size_t>(k) < count;
        if (!fine) throw std::invalid_argument("the points or materials of BSDFs have sizes that disagree");
    }

    size_t count() const { return material_.size(); }
    BsdfTask task() const {
        const size_t n = count();
        return {static_cast<int64_t>(n),
                kind_.data(),
                flags_.data(),
                rows.data(),
                material_.data(),
                inside_.data(),
                normal.data(),
                true_normal.data(),
                tangent.data(),
                wo.data(),
                wi.data(),
                {random.data(), random.data() + n, random.data() + 2 * n}};
    }

 private:
    std::vector<int32_t> kind_, flags_, material_, inside_;

 public:
    const std::vector<float> rows, normal, true_normal, tangent, wo, wi, random;
};

nb::dict evaluate(nb::handle materials, nb::handle points, nb::handle instruction_set, int32_t favoured) {
    const Points p(materials, points);
    BsdfTask task = p.task();
    task.favoured = favoured;
    const size_t n = p.count();
    Output<float> value(n, 3), pdf(n), emission(n, 3), sample_wi(n, 3), weight(n, 3), sample_pdf(n);
    Output<int32_t> active(n), specular(n), transmitted(n), ray_kind(n);
    const BsdfResult result = {value.values.data(),     pdf.values.data(),      emission.values.data(),
                               sample_wi.values.data(), weight.values.data(),   sample_pdf.values.data(),
                               active.values.data(),    specular.values.data(), transmitted.values.data(),
                               ray_kind.values.data()};
    const KernelTable& table = with_probes(kernels(text(instruction_set)));
    without_interpreter([&] { table.bsdfs(task, result); });
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

// Names of the floats on which BSDFs depend.
ProbeTables tables_of(const Points& p) {
    return {{"params", p.rows},     {"normal", p.normal}, {"true_normal", p.true_normal},
            {"tangent", p.tangent}, {"wo", p.wo},         {"wi", p.wi}};
}

nb::dict backward(nb::handle materials, nb::handle points, nb::handle adjoint, nb::handle instruction_set) {
    const Points p(materials, points);
    const KernelTable& table = with_probes(kernels(text(instruction_set)));
    return probe_backward(tables_of(p), adjoint, p.count(), kBsdfOutputs,
                          [&](const ProbeSweep& sweep) { table.bsdf_derivatives(p.task(), sweep); });
}

nb::object forward(nb::handle materials, nb::handle points, nb::handle tangents, nb::handle instruction_set) {
    const Points p(materials, points);
    const KernelTable& table = with_probes(kernels(text(instruction_set)));
    return probe_forward(tables_of(p), tangents, p.count(), kBsdfOutputs,
                         [&](const ProbeSweep& sweep) { table.bsdf_derivatives(p.task(), sweep); });
}

}  // namespace

void bind_bsdfs(nb::module_& m) {
    m.def("evaluate_bsdfs", &evaluate, "materials"_a, "points"_a, "instruction_set"_a, "favoured"_a = 0,
          "Evaluates and samples BSDFs at points.");
    m.def("bsdfs_backward", &backward, "materials"_a, "points"_a, "adjoint"_a, "instruction_set"_a,
          "Gradients of BSDFs' values and emissions.");
    m.def("bsdfs_forward", &forward, "materials"_a, "points"_a, "tangents"_a, "instruction_set"_a,
          "Tangents of BSDFs' values and emissions.");
}

}  // namespace edgegrad
