#include "sdf/carrier/carrier.h"

#include <algorithm>

#include "sdf/bricks/coefficient_blocks.h"
#include "sdf/carrier/marching.h"
#include "sdf/carrier/thin_parts.h"
#include "sdf/outline_point.h"
#include "util/parallel.h"

namespace edgegrad {

FieldCarrier field_carrier(const FieldView& view, int threads) {
    FieldView field = view;
    std::vector<uint8_t> signs;
    if (field.signs == nullptr) {
        find_signs(field, {}, threads, signs);
        field.signs = signs.data();
    }
    FieldCarrier out;
    ThinParts thin(field);
    march_cells(
        field, [](const Cell&) { return false; },
        [&](const Cell& cell, bool crosses) { thin.add(cell, crosses); }, out);
    const FineRegion fine = thin.region();
    if (fine.crosses) {
        out = {};
        march_cells(
            field, [&](const Cell& cell) { return fine.contains(cell); }, [](const Cell&, bool) {}, out);
    }
    march_parts(field, fine.cells, fine.parts, out);
    out.complete = fine.complete;
    // Pull the vertices towards the surface, but not far where the gradient vanishes
    constexpr double kMostPull = 0.5;
    constexpr size_t kBlock = 1024;
    out.gradient.resize(out.point.size());
    parallel_blocks(threads, out.point.size() / 3, kBlock, [&](size_t, size_t first, size_t last) {
        for (size_t n = first; n < last; ++n) {
            double x[3];
            std::copy_n(&out.point[3 * n], 3, x);
            const SplineJet jet = spline_jet(field, x);
            double square = 0.0;
            for (const double g : jet.gradient) square += g * g;
            const double step = square > 0.0 ? jet.value / square : 0.0;
            if (step * step * square < kMostPull * kMostPull)
                for (size_t k = 0; k < 3; ++k) x[k] -= step * jet.gradient[k];
            std::copy_n(x, 3, &out.point[3 * n]);
            std::copy_n(spline_jet(field, x).gradient, 3, &out.gradient[3 * n]);
        }
    });
    return out;
}

FieldPatch field_patch(const FieldCarrier& carrier, size_t triangle) {
    FieldPatch out;
    for (size_t k = 0; k < 3; ++k) {
        const size_t corner = 3 * static_cast<size_t>(carrier.triangle[3 * triangle + k]);
        for (size_t c = 0; c < 3; ++c) {
            out.point[k][c] = static_cast<float>(carrier.point[corner + c]);
            out.gradient[k][c] = static_cast<float>(carrier.gradient[corner + c]);
        }
    }
    return out;
}

bool may_end_at_its_box(const FieldView& f) {
    const auto outer = [&](int axis, int k) { return k < 3 || k >= f.size[axis] - 3; };
    const bool inside = f.values[0] < 0.0f;
    const float* at = f.values;
    for (int i = 0; i < f.size[0]; ++i)
        for (int j = 0; j < f.size[1]; ++j, at += f.size[2]) {
            const bool whole = outer(0, i) || outer(1, j);
            for (int k = 0; k < f.size[2]; k = whole || k != 2 ? k + 1 : std::max(3, f.size[2] - 3))
                if ((at[k] < 0.0f) != inside) return true;
        }
    return false;
}

}  // namespace edgegrad
