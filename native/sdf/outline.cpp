#include "sdf/outline.h"

#include <algorithm>
#include <array>

#include "util/parallel.h"

namespace edgegrad {
namespace {

using Point = std::array<double, 3>;
constexpr size_t kBlock = 1024;

}  // namespace

std::vector<float> field_outline(const FieldView& field, const FieldCarrier& carrier,
                                 const FieldViewer& viewer, int threads) {
    // The sides of all vertices: g . v at each
    const size_t vertices = carrier.point.size() / 3;
    std::vector<double> side(vertices);
    parallel_blocks(threads, vertices, kBlock, [&](size_t, size_t first, size_t last) {
        for (size_t n = first; n < last; ++n) {
            double x[3], v[3], sum = 0.0;
            std::copy_n(&carrier.point[3 * n], 3, x);
            viewer.direction(x, v);
            for (size_t k = 0; k < 3; ++k) sum += carrier.gradient[3 * n + k] * v[k];
            side[n] = sum;
        }
    });
    // The point of the outline on the edge between two vertices, the same for both triangles of the edge
    const auto end_on = [&](uint32_t one, uint32_t other, Point& x, bool& clear) {
        const size_t a = std::min(one, other), b = std::max(one, other);
        const double part = side[a] / (side[a] - side[b]);
        double at[3];
        for (size_t k = 0; k < 3; ++k)
            at[k] = carrier.point[3 * a + k] + part * (carrier.point[3 * b + k] - carrier.point[3 * a + k]);
        const bool found = pull_to_outline(field, viewer, at, clear);
        x = {at[0], at[1], at[2]};
        return found;
    };
    const size_t triangles = carrier.triangle.size() / 3;
    std::vector<std::vector<float>> parts((triangles + kBlock - 1) / kBlock);
    parallel_blocks(threads, triangles, kBlock, [&](size_t block, size_t first, size_t last) {
        for (size_t n = first; n < last; ++n) {
            const uint32_t* corner = &carrier.triangle[3 * n];
            bool front[3];
            for (size_t k = 0; k < 3; ++k) front[k] = side[corner[k]] >= 0.0;
            if (front[0] == front[1] && front[1] == front[2]) continue;
            const size_t lone = front[1] == front[2] ? 0 : front[0] == front[2] ? 1 : 2;
            const uint32_t top = corner[lone], left = corner[(lone + 1) % 3], right = corner[(lone + 2) % 3];
            // The tangent g x grad G has the larger G on its right, as seen from outside
            Point end[2];
            bool clear[2];
            if (!end_on(top, front[lone] ? right : left, end[0], clear[0])) continue;
            if (!end_on(top, front[lone] ? left : right, end[1], clear[1])) continue;
            if (!clear[0] && !clear[1] && !field.inside) continue;
            for (const Point& x : end) {
                const double grid[3] = {x[0], x[1], x[2]};
                double place[3];
                field.place_in_world(grid, place);
                for (const double c : place) parts[block].push_back(static_cast<float>(c));
            }
        }
    });
    std::vector<float> out;
    for (const std::vector<float>& part : parts) out.insert(out.end(), part.begin(), part.end());
    return out;
}

}  // namespace edgegrad
