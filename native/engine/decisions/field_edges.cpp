#include "engine/decisions/field_edges.h"

#include <algorithm>
#include <cmath>

#include "boundary/fields/field_insides.h"
#include "engine/decisions/decisions.h"
#include "engine/decisions/followed_lobes_rule.h"
#include "scene/sharp_lobes.h"
#include "util/parallel.h"

namespace edgegrad {
namespace {

// Half of the width of bands, in pixels. A wider band of the warp has less noise, but needs more near misses;
// the bias of a relaxed boundary grows with the square of its width.
constexpr double kWarpPixels = 1.5, kRelaxedPixels = 0.75;
// Bands are at most as wide as this number of cells, within which near misses are searched.
constexpr double kMostCells = 1.0;

struct SurfaceBox {
    double low[3], high[3];
};

// A box in the world that contains the surface of a field: of all cells with coefficients of both signs.
SurfaceBox surface_box(const FieldView& f) {
    int32_t first[3] = {f.size[0], f.size[1], f.size[2]}, last[3] = {0, 0, 0};
    for (int32_t x = 0; x < f.size[0]; ++x)
        for (int32_t y = 0; y < f.size[1]; ++y) {
            const float* row = f.values + (static_cast<int64_t>(x) * f.size[1] + y) * f.size[2];
            for (int32_t z = 0; z < f.size[2]; ++z) {
                if (!(row[z] < 0.0f)) continue;
                const int32_t at[3] = {x, y, z};
                for (int a = 0; a < 3; ++a)
                    first[a] = std::min(first[a], at[a]), last[a] = std::max(last[a], at[a]);
            }
        }
    SurfaceBox out;
    for (int c = 0; c < 3; ++c) out.low[c] = HUGE_VAL, out.high[c] = -HUGE_VAL;
    if (first[0] > last[0]) return out;
    // A coefficient (i, j, k) counts for cells up to three before it
    for (int corner = 0; corner < 8; ++corner) {
        double grid[3], p[3];
        for (int a = 0; a < 3; ++a) grid[a] = (corner >> a & 1) ? last[a] + 1.0 : first[a] - 3.0;
        f.place_in_world(grid, p);
        for (int c = 0; c < 3; ++c)
            out.low[c] = std::min(out.low[c], p[c]), out.high[c] = std::max(out.high[c], p[c]);
    }
    return out;
}

bool seen_by_camera(const SceneTables& t, size_t field) {
    const auto mesh = static_cast<size_t>(t.first_field()) + field;
    return (t.mesh_mask[mesh] & (1 << kCameraRay)) != 0;
}

// Where surfaces of two fields meet, the warp would jump.
bool fields_may_meet(const SceneTables& t) {
    std::vector<SurfaceBox> boxes;
    for (size_t k = 0; k < t.fields.size(); ++k)
        if (seen_by_camera(t, k)) boxes.push_back(surface_box(t.fields[k].view()));
    for (size_t a = 0; a < boxes.size(); ++a)
        for (size_t b = 0; b < a; ++b) {
            bool apart = false;
            for (int c = 0; c < 3; ++c)
                apart |= boxes[a].high[c] < boxes[b].low[c] || boxes[b].high[c] < boxes[a].low[c];
            if (!apart) return true;
        }
    return false;
}

// Bound of the gradient in grid coordinates: by the differences of neighbouring coefficients.
double steepest(const FieldView& f, int threads) {
    std::vector<double> most(3 * static_cast<size_t>(f.size[0]), 0.0);
    const int64_t step = f.size[2], slab = step * f.size[1];
    parallel_for(threads, f.size[0], nullptr, [&](int, int64_t x) {
        float largest[3] = {};
        const float* v = f.values + x * slab;
        for (int64_t k = 0; k < slab; ++k) {
            const int64_t z = k % step;
            if (x + 1 < f.size[0]) largest[0] = std::max(largest[0], std::abs(v[k + slab] - v[k]));
            if (k + step < slab) largest[1] = std::max(largest[1], std::abs(v[k + step] - v[k]));
            if (z + 1 < step) largest[2] = std::max(largest[2], std::abs(v[k + 1] - v[k]));
        }
        for (size_t a = 0; a < 3; ++a) most[3 * static_cast<size_t>(x) + a] = static_cast<double>(largest[a]);
    });
    double square = 0.0;
    for (size_t a = 0; a < 3; ++a) {
        double largest = 0.0;
        for (size_t x = 0; x < static_cast<size_t>(f.size[0]); ++x)
            largest = std::max(largest, most[3 * x + a]);
        square += largest * largest;
    }
    return std::sqrt(square);
}

}  // namespace

FieldEdges used_field_edges(const SceneTables& t, const RenderOptions& options, const Requested& requested) {
    if (options.field_edges == FieldEdges::kOutlines || t.fields.empty()) return FieldEdges::kOutlines;
    const bool relaxed = options.field_edges == FieldEdges::kRelaxed;
    if (is_panorama(t.camera.kind)) return FieldEdges::kOutlines;
    if (relaxed) return options.field_edges;
    // The warp concerns what moves with fields
    if (!requested.moves_fields()) return FieldEdges::kOutlines;
    for (size_t k = 0; k < t.fields.size(); ++k)
        if (light_may_be_inside(t, k)) return FieldEdges::kOutlines;
    const bool mirrors = options.max_depth > 1 && !used_materials(t, [&](size_t closure) {
                                                       return may_be_specular(t, closure, kWidestFollowed);
                                                   }).empty();
    return mirrors || fields_may_meet(t) ? FieldEdges::kOutlines : options.field_edges;
}

std::vector<FieldBand> field_bands(const SceneTables& t, FieldEdges edges, int threads) {
    std::vector<FieldBand> out;
    if (edges == FieldEdges::kOutlines) return out;
    const CameraView& c = t.camera;
    for (size_t k = 0; k < t.fields.size(); ++k) {
        FieldBand& band = out.emplace_back();
        if (!seen_by_camera(t, k)) continue;
        const FieldView f = t.fields[k].view();
        // The size of a cell in the picture, at the middle of the field
        const double halves[3] = {0.5 * f.cells(0), 0.5 * f.cells(1), 0.5 * f.cells(2)};
        double middle[3], depth = 0.0, cell = 0.0;
        f.place_in_world(halves, middle);
        for (int i = 0; i < 3; ++i) {
            for (int a = 0; a < 3; ++a) cell += f.to_world[i][a] * f.to_world[i][a] / 3.0;
            depth -= (middle[i] - static_cast<double>(c.position[i])) * static_cast<double>(c.back[i]);
        }
        const double near = static_cast<double>(c.clip_start);
        const double scale =
            static_cast<double>(c.focal) / (c.kind == kOrthographic ? 1.0 : std::max(depth, near));
        const double pixels = edges == FieldEdges::kRelaxed ? kRelaxedPixels : kWarpPixels;
        band.pixels = static_cast<float>(std::min(pixels, kMostCells * std::sqrt(cell) * scale));
        band.steepest = static_cast<float>(std::max(steepest(f, threads), 1e-30));
        band.least_curvature = 1.0f / static_cast<float>(std::max({f.cells(0), f.cells(1), f.cells(2)}));
    }
    return out;
}

}  // namespace edgegrad
