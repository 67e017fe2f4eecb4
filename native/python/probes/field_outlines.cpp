#include "python/probes/field_outlines.h"

#include <algorithm>
#include <vector>

#include "python/numpy_arrays.h"
#include "sdf/outline.h"

namespace nb = nanobind;

namespace edgegrad {

nb::dict field_outline_points(nb::handle values, nb::handle to_world, nb::handle viewer, nb::handle u,
                              int threads) {
    const InputArray<float> coefficients(values, "values", {-1, -1, -1}), fractions(u, "u", {-1});
    const InputArray<double> rows(to_world, "to_world", {3, 4}), from(viewer, "viewer", {3});
    int32_t size[3];
    for (int a = 0; a < 3; ++a) size[a] = static_cast<int32_t>(coefficients.shape(a));
    double map[12], point[3];
    std::copy_n(rows.data(), 12, map);
    std::copy_n(from.data(), 3, point);
    const FieldView field = field_view(coefficients.data(), size, map);
    const FieldViewer seen_from = viewer_at(field, point);
    const std::vector<float> ends = field_outline(field, field_carrier(field, threads), seen_from, threads);
    const size_t segments = ends.size() / 6, each = fractions.size();
    std::vector<float> position, tangent, sign;
    for (size_t k = 0; k < segments; ++k) {
        float a[3], b[3];
        std::copy_n(&ends[6 * k], 3, a);
        std::copy_n(&ends[6 * k + 3], 3, b);
        for (size_t j = 0; j < each; ++j) {
            OutlinePoint p{};
            const bool found = outline_point(field, seen_from, a, b, fractions.data()[j], p);
            position.insert(position.end(), p.position, p.position + 3);
            tangent.insert(tangent.end(), p.tangent, p.tangent + 3);
            sign.push_back(!found ? 0.0f : p.reversed ? -1.0f : 1.0f);
        }
    }
    nb::dict out;
    out["ends"] = to_numpy(ends, {segments, 2, 3});
    out["position"] = to_numpy(position, {segments, each, 3});
    out["tangent"] = to_numpy(tangent, {segments, each, 3});
    out["sign"] = to_numpy(sign, {segments, each});
    return out;
}

}  // namespace edgegrad
