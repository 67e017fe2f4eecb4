// Bindings of outlines and of surfaces of distance fields, for tests.
#include "python/bindings.h"

#include <algorithm>
#include <vector>

#include "python/numpy_arrays.h"
#include "reparameterisation/picture_warp.h"
#include "sdf/outline.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace edgegrad {

namespace {

FieldView view_of(const InputArray<float>& coefficients, nb::handle to_world) {
    const InputArray<double> rows(to_world, "to_world", {3, 4});
    int32_t size[3];
    for (int a = 0; a < 3; ++a) size[a] = static_cast<int32_t>(coefficients.shape(a));
    double map[12];
    std::copy_n(rows.data(), 12, map);
    return field_view(coefficients.data(), size, map);
}

// The outline of a field, seen from a point, as arrays: `ends` (n, 2, 3) of the segments, and for each of the
// fractions `u` (m) of each segment `position` (n, m, 3), `tangent` (n, m, 3), and `sign` (n, m): 0 where
// there is no point, -1 where the outline runs back.
nb::dict field_outline_points(nb::handle values, nb::handle to_world, nb::handle viewer, nb::handle u,
                              int threads) {
    const InputArray<float> coefficients(values, "values", {-1, -1, -1}), fractions(u, "u", {-1});
    const InputArray<double> from(viewer, "viewer", {3});
    double point[3];
    std::copy_n(from.data(), 3, point);
    const FieldView field = view_of(coefficients, to_world);
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

// Points of the patches of a field's surface at the places (m, 2) of each, as arrays: `position` and `normal`
// (n, m, 3), and `area` (n, m), 0 where there is no point (sdf/surface_patch.h).
nb::dict field_surface_points(nb::handle values, nb::handle to_world, nb::handle places, int threads) {
    const InputArray<float> coefficients(values, "values", {-1, -1, -1}), uv(places, "places", {-1, 2});
    const FieldView field = view_of(coefficients, to_world);
    const FieldCarrier carrier = field_carrier(field, threads);
    const size_t patches = carrier.triangle.size() / 3, each = uv.size() / 2;
    std::vector<float> position, normal, area;
    for (size_t k = 0; k < patches; ++k) {
        const FieldPatch patch = field_patch(carrier, k);
        for (size_t j = 0; j < each; ++j) {
            PatchPoint p{};
            if (!patch_point(field, patch, uv.data()[2 * j], uv.data()[2 * j + 1], p)) p.area = 0.0f;
            position.insert(position.end(), p.position, p.position + 3);
            normal.insert(normal.end(), p.normal, p.normal + 3);
            area.push_back(p.area);
        }
    }
    nb::dict out;
    out["position"] = to_numpy(position, {patches, each, 3});
    out["normal"] = to_numpy(normal, {patches, each, 3});
    out["area"] = to_numpy(area, {patches, each});
    return out;
}

// The warp of the picture (reparameterisation/picture_warp.h) at perspective rays (n, 2, 3) of origins and
// directions of unit depth, which turn with the place in the picture by `across` (2, 3). Each has one near
// miss, near `depth` (n). As arrays: `apart` (n), `point` (n, 3), `step` (n, 2), `spread` (n), `along` (n,
// 3).
nb::dict field_warps(nb::handle values, nb::handle to_world, nb::handle rays, nb::handle depth,
                     nb::handle across, float pixels, float least_curvature) {
    const InputArray<float> coefficients(values, "values", {-1, -1, -1});
    const InputArray<double> lines(rays, "rays", {-1, 2, 3}), depths(depth, "depth", {-1}),
        turns(across, "across", {2, 3});
    const FieldView field = view_of(coefficients, to_world);
    const FieldBand band{pixels, 1.0f, least_curvature};
    const size_t count = depths.size();
    std::vector<float> apart, point, step, spread, along;
    for (size_t k = 0; k < count; ++k) {
        PictureRay ray{};
        std::copy_n(lines.data() + 6 * k, 3, ray.origin);
        std::copy_n(lines.data() + 6 * k + 3, 3, ray.direction);
        for (size_t j = 0; j < 2; ++j) std::copy_n(turns.data() + 3 * j, 3, ray.across[j]);
        NearMiss miss{};
        miss.field = &field;
        miss.depth = depths.data()[k];
        for (int n = 0; n < 30; ++n) {
            double x[3], slope = 0.0, bend = 0.0, d[3];
            for (int c = 0; c < 3; ++c) x[c] = ray.origin[c] + miss.depth * ray.direction[c];
            field.place_in_grid(x, miss.grid);
            miss.jet = spline_jet(field, miss.grid);
            const auto& [value, g, h] = miss.jet;
            for (int a = 0; a < 3; ++a) {
                d[a] = 0.0;
                for (int c = 0; c < 3; ++c) d[a] += field.to_grid[a][c] * ray.direction[c];
                slope += g[a] * d[a];
            }
            for (int a = 0; a < 3; ++a) bend += h[a] * d[a] * d[a];
            bend += 2.0 * (h[3] * d[1] * d[2] + h[4] * d[0] * d[2] + h[5] * d[0] * d[1]);
            miss.depth -= slope / bend;
        }
        const bool within = see_near_miss(ray, band, miss);
        const WarpPart part = within ? warp_of(&miss, 1).part[0] : WarpPart{};
        apart.push_back(static_cast<float>(miss.apart));
        point.insert(point.end(), part.point, part.point + 3);
        step.insert(step.end(), part.step, part.step + 2);
        spread.push_back(part.spread);
        along.insert(along.end(), part.along, part.along + 3);
    }
    nb::dict out;
    out["apart"] = to_numpy(apart, {count});
    out["point"] = to_numpy(point, {count, 3});
    out["step"] = to_numpy(step, {count, 2});
    out["spread"] = to_numpy(spread, {count});
    out["along"] = to_numpy(along, {count, 3});
    return out;
}

}  // namespace

void bind_fields(nb::module_& m) {
    m.def("field_warps", &field_warps, "values"_a, "to_world"_a, "rays"_a, "depth"_a, "across"_a, "pixels"_a,
          "least_curvature"_a, "The warp of the picture (native/python/probes/field_outlines.cpp).");
    m.def("field_outline_points", &field_outline_points, "values"_a, "to_world"_a, "viewer"_a, "u"_a,
          "threads"_a, "The outline of a distance field (native/python/probes/field_outlines.cpp).");
    m.def("field_surface_points", &field_surface_points, "values"_a, "to_world"_a, "places"_a, "threads"_a,
          "Points of a distance field's surface (native/python/probes/field_outlines.cpp).");
}

}  // namespace edgegrad
