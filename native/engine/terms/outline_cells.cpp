#include "engine/terms/outline_cells.h"

#include <algorithm>
#include <cmath>

#include "boundary/curves/picture_frame.h"

namespace edgegrad {
namespace {

// The largest number of cells along each side.
constexpr double kMostCells = 512.0;
// The weight of cells far from outlines, of which there are many: bands may extend to where no outline is.
constexpr double kFar = 0.02;

// Calls visit(low, high) with the bounds in pixels of each segment in the picture; all of it where these are
// not known.
template <typename Visit>
void visit_bounds(const PictureFrame& frame, const CameraView& camera, const Intersections& outlines,
                  const Visit& visit) {
    for (int64_t k = 0; k < outlines.size(); ++k) {
        const float* p = &outlines.ends[6 * static_cast<size_t>(k)];
        const Vector a = {p[0], p[1], p[2]}, b = {p[3], p[4], p[5]};
        bool seen = false;
        frame.visit_segments(a, b, [&](const PictureFrame::EdgeSegment&) { seen = true; });
        if (!seen) continue;
        const auto one = frame.around(a), other = frame.around(b);
        const double margin = std::max(frame.margin(), 0.0);
        double low[2] = {0.0, 0.0}, high[2] = {camera.width + 2.0 * margin, camera.height + 2.0 * margin};
        for (int c = 0; c < 2 && one && other; ++c) {
            low[c] = std::min(one->low[c], other->low[c]);
            high[c] = std::max(one->high[c], other->high[c]);
        }
        visit(low, high);
    }
}

}  // namespace

Candidates outline_cells(const CameraView& camera, const Intersections& outlines, int32_t line, double pixels,
                         double requested) {
    const PictureFrame frame(camera);
    const auto n = static_cast<int32_t>(std::clamp(std::sqrt(requested), 1.0, kMostCells));
    const double margin = std::max(frame.margin(), 0.0);
    const double size[2] = {camera.width + 2.0 * margin, camera.height + 2.0 * margin};
    std::vector<uint8_t> near(static_cast<size_t>(n) * static_cast<size_t>(n), 0);
    bool any = false;
    const auto mark = [&](const double (&low)[2], const double (&high)[2]) {
        int32_t first[2], last[2];
        for (int a = 0; a < 2; ++a) {
            const auto cell = [&](double at) {
                return static_cast<int32_t>(
                    std::clamp(std::floor((at + margin) / size[a] * n), 0.0, n - 1.0));
            };
            first[a] = cell(low[a] - pixels), last[a] = cell(high[a] + pixels);
        }
        for (int32_t row = first[1]; row <= last[1]; ++row)
            std::fill_n(near.begin() + static_cast<int64_t>(row) * n + first[0], last[0] - first[0] + 1, 1);
    };
    visit_bounds(frame, camera, outlines, [&](const double (&low)[2], const double (&high)[2]) {
        any = true;
        mark(low, high);
    });
    Candidates out;
    if (!any) return out;
    out.direction_cells = n;
    for (int32_t row = 0; row < n; ++row)
        for (int32_t column = 0; column < n; ++column) {
            const int32_t place = row * n + (row % 2 ? n - 1 - column : column);
            out.edge.push_back(line);
            out.u0.push_back(0.0f), out.u1.push_back(1.0f);
            out.cell.emplace_back(place, false);
            out.cumulative.push_back(out.cumulative.back() + (near[static_cast<size_t>(place)] ? 1.0 : kFar));
        }
    return out;
}

std::vector<uint8_t> outline_pixels(const CameraView& camera, const Intersections& outlines) {
    const PictureFrame frame(camera);
    const double reach = std::max(frame.margin(), 0.0);
    const int32_t size[2] = {camera.width, camera.height};
    std::vector<uint8_t> near(static_cast<size_t>(size[0]) * static_cast<size_t>(size[1]), 0);
    visit_bounds(frame, camera, outlines, [&](const double (&low)[2], const double (&high)[2]) {
        int32_t first[2], last[2];
        for (int a = 0; a < 2; ++a) {
            const auto pixel = [&](double at) {
                return static_cast<int32_t>(std::clamp(std::floor(at), -1.0, static_cast<double>(size[a])));
            };
            first[a] = std::max(pixel(low[a] - reach), 0);
            last[a] = std::min(pixel(high[a] + reach), size[a] - 1);
        }
        for (int32_t row = first[1]; row <= last[1]; ++row)
            for (int32_t column = first[0]; column <= last[0]; ++column)
                near[static_cast<size_t>(row) * static_cast<size_t>(size[0]) + static_cast<size_t>(column)] =
                    1;
    });
    return near;
}

}  // namespace edgegrad
