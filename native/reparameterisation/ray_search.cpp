#include "reparameterisation/ray_search.h"

#include <algorithm>
#include <cmath>

#include "sdf/field_block.h"
#include "sdf/spline.h"
#include "sdf/triple.h"

namespace edgegrad::EDGEGRAD_ISA {
namespace {

using edgegrad::dot;  // that of triples

// Steps near the surface, in cells.
constexpr double kStep = 0.5;
// A minimum is refined to this part of a cell.
constexpr double kResolved = 1e-9;
constexpr int kMostRefinements = 30;

// A ray in the coordinates of a grid, and the field's value and slope along it.
struct GridRay {
    const FieldView& field;
    double origin[3], direction[3];

    GridRay(const FieldView& f, const PictureRay& ray) : field(f) {
        f.place_in_grid(ray.origin, origin);
        f.vector_in_grid(ray.direction, direction);
    }
    double length() const { return std::sqrt(dot(direction, direction)); }
    void place(double t, double (&grid)[3]) const {
        for (int a = 0; a < 3; ++a) grid[a] = origin[a] + t * direction[a];
    }
    // The part of the ray within the field's box.
    bool clip(double& from, double& to) const {
        for (int a = 0; a < 3; ++a) {
            const double d = direction[a], end = field.cells(a);
            if (d == 0.0) {
                if (origin[a] < 0.0 || origin[a] > end) return false;
                continue;
            }
            const double one = -origin[a] / d, other = (end - origin[a]) / d;
            from = std::max(from, std::min(one, other));
            to = std::min(to, std::max(one, other));
        }
        return from < to;
    }
    void evaluate(double t, float& value, float& slope) const {
        double grid[3];
        int32_t cell[3];
        float at[3];
        place(t, grid);
        find_cell(field, grid, cell, at);
        const FieldPoint p = spline(field, cell, at);
        value = p.value;
        slope = static_cast<float>(static_cast<double>(p.gradient[0]) * direction[0] +
                                   static_cast<double>(p.gradient[1]) * direction[1] +
                                   static_cast<double>(p.gradient[2]) * direction[2]);
    }
};

// The minimum between two depths with slopes of different signs, by Newton's method within the bracket.
void refine(const GridRay& ray, double low, double high, NearMiss& out) {
    const double least = kResolved / ray.length();
    double t = 0.5 * (low + high);
    const auto& d = ray.direction;
    for (int k = 0;; ++k) {
        ray.place(t, out.grid);
        out.jet = spline_jet(ray.field, out.grid);
        const auto& [value, g, h] = out.jet;
        Triple bent;
        times(h, d, bent);
        const double slope = dot(g, d), curvature = dot(d, bent);
        (slope < 0.0 ? low : high) = t;
        double next = t - slope / curvature;
        if (!(next > low && next < high)) next = 0.5 * (low + high);
        if (k == kMostRefinements || std::abs(next - t) < least) break;
        t = next;
    }
    out.depth = t;
}

// Near misses of one field, and the depth at which it stops the ray.
class FieldSearch {
 public:
    FieldSearch(const PictureRay& ray, const FieldView& field, const FieldBand& band, NearMiss* out,
                int& count)
        : ray_(ray), band_(band), out_(out), count_(count), grid_(field, ray) {}

    double run() {
        double from = ray_.near, to = ray_.far;
        if (!grid_.clip(from, to)) return kNever;
        // Farther from zero than this the field has no near miss
        const double length = grid_.length(), most = static_cast<double>(band_.steepest) * length;
        const double reach =
            static_cast<double>(band_.pixels * band_.steepest) * (ray_.parallel ? 1.0 : to) * across();
        const double step = kStep / length;
        double t = from;
        float value, slope;
        grid_.evaluate(t, value, slope);
        if (value < 0.0f) return t;
        double entry = kNever;
        while (t < to) {
            const double spare = std::abs(static_cast<double>(value)) - reach;
            if (entry < kNever && spare > 0.0) return entry;  // it meets the surface far from the outline
            const double next = std::min(to, t + std::max(step, spare / most));
            float next_value, next_slope;
            grid_.evaluate(next, next_value, next_slope);
            if (slope < 0.0f && next_slope >= 0.0f && spare < most * step) {
                if (const double hit = add(t, next); hit < kNever) return hit;
            }
            if (next_value < 0.0f)
                entry = std::min(entry, next);
            else if (entry < kNever)
                return entry;
            t = next, value = next_value, slope = next_slope;
        }
        return entry;
    }
    static constexpr double kNever = HUGE_VAL;

 private:
    // Length of a pixel in grid coordinates at unit depth.
    double across() const {
        double most = 0.0;
        for (const auto& e : ray_.across) {
            double in_grid[3];
            grid_.field.vector_in_grid(e, in_grid);
            for (const double part : in_grid) most += part * part;
        }
        return std::sqrt(most);
    }
    // Adds the minimum between two depths, if it is a near miss. Returns its depth where the ray meets the
    // surface there.
    double add(double low, double high) {
        NearMiss miss;
        miss.field = &grid_.field;
        refine(grid_, low, high, miss);
        if (see_near_miss(ray_, band_, miss) && count_ < kRoom) out_[count_++] = miss;
        return miss.jet.value < 0.0 ? miss.depth : kNever;
    }

    const PictureRay& ray_;
    const FieldBand& band_;
    NearMiss* const out_;
    int& count_;
    const GridRay grid_;

 public:
    static constexpr int kRoom = 4 * kMostNearMisses;
};

}  // namespace

int find_near_misses(const SceneView& scene, const PictureRay& ray, NearMiss (&out)[kMostNearMisses]) {
    NearMiss all[FieldSearch::kRoom];
    int count = 0;
    double hit = FieldSearch::kNever;
    for (int32_t k = 0; k < scene.field_count; ++k)
        if (scene.field_bands[k].pixels > 0.0f)
            hit = std::min(hit, FieldSearch(ray, scene.fields[k], scene.field_bands[k], all, count).run());
    // Keep those that the nearest surface does not hide
    int seen = 0;
    for (int k = 0; k < count; ++k)
        if (all[k].depth <= hit) all[seen++] = all[k];
    std::sort(all, all + seen, [](const NearMiss& a, const NearMiss& b) { return a.depth < b.depth; });
    seen = std::min(seen, kMostNearMisses);
    std::copy(all, all + seen, out);
    return seen;
}

PictureRay picture_ray(const CameraView& camera, const float (&origin)[3], const float (&direction)[3]) {
    PictureRay r;
    double depth = 0.0;
    for (int c = 0; c < 3; ++c)
        depth -= static_cast<double>(direction[c]) * static_cast<double>(camera.back[c]);
    for (int c = 0; c < 3; ++c) {
        r.origin[c] = static_cast<double>(origin[c]);
        r.direction[c] = static_cast<double>(direction[c]) / depth;
        r.across[0][c] = static_cast<double>(camera.right[c]) / static_cast<double>(camera.focal);
        r.across[1][c] = -static_cast<double>(camera.up[c]) * static_cast<double>(camera.pixel_aspect) /
                         static_cast<double>(camera.focal);
    }
    r.parallel = camera.kind == kOrthographic;
    r.near = static_cast<double>(camera.clip_start), r.far = static_cast<double>(camera.clip_end);
    return r;
}

float warp_forward(const PictureWarp& warp, const FieldDerivatives& fields, float by_x, float by_y) {
    float sum = 0.0f;
    for (int k = 0; k < warp.count; ++k) {
        const WarpPart& p = warp.part[k];
        if (!fields.moves(*p.field)) continue;
        float change, slope[3];
        field_forward(*p.field, fields, field_jet(*p.field, p.point), change, slope);
        sum += (by_x * p.step[0] + by_y * p.step[1]) * change;
    }
    return sum;
}

void warp_backward(const PictureWarp& warp, const FieldDerivatives& fields, float by_x, float by_y) {
    for (int k = 0; k < warp.count; ++k) {
        const WarpPart& p = warp.part[k];
        if (!fields.moves(*p.field)) continue;
        field_backward(*p.field, fields, field_jet(*p.field, p.point), by_x * p.step[0] + by_y * p.step[1],
                       {0.0f, 0.0f, 0.0f});
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
