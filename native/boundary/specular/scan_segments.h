// The places of scan lines in the picture, whose chains are compared (boundary/specular/scan_lines.h).
#pragma once

#include <algorithm>

#include "boundary/specular/chain.h"
#include "tasks/scan_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// Two segments that share an end, at which the chain's events are chosen.
struct SegmentPair {
    Mask active, horizontal;
    PicturePoint chosen, end[2];
    UInt stream;
    Float low, high;  // of the tile, along the line; crossings elsewhere belong to other tiles
    Float share;      // weight of a line: line spacing times the weight of the pass
};

// The pairs of segments of the task from `at` on.
EG_INLINE SegmentPair scan_segments(const ScanTask& task, int64_t at) {
    SegmentPair s;
    s.active = splat(0);
    const int32_t segments = scan_line_segments(task.tile);
    const int64_t tiles = static_cast<int64_t>(task.columns) * task.rows;
    int64_t tile =
        std::upper_bound(task.tile_first, task.tile_first + tiles, task.first + at) - task.tile_first - 1;
    // Find the tile and the line of each segment
    for (int i = 0; i < W; ++i) {
        const int64_t k = task.first + at + 2 * i;
        s.active[i] = at + 2 * i < task.count ? -1 : 0;
        while (tile + 1 < tiles && task.tile_first[tile + 1] <= k) ++tile;
        const int32_t lines = task.tile_lines[tile];
        const auto number = static_cast<int32_t>(k - task.tile_first[tile]), line = number / segments;
        const bool flat = line < lines;
        const int along = flat ? 0 : 1;
        const int64_t place_of_tile[2] = {tile % task.columns, tile / task.columns};
        float low[2], high[2];
        for (int axis = 0; axis < 2; ++axis) {
            low[axis] = task.low[axis] + task.tile * static_cast<float>(place_of_tile[axis]);
            high[axis] = __builtin_fminf(low[axis] + task.tile, task.high[axis]);
        }
        const float width = high[1 - along] - low[1 - along];
        // Lines are evenly spaced, each with a random offset within its strip.
        const uint32_t random = hash(static_cast<uint32_t>(k - number % segments) ^ hash(task.seed));
        const auto uniform = [random](uint32_t which) {
            return static_cast<float>(hash(random ^ (0x9e3779b9u * which)) >> 8) * 5.9604645e-8f;
        };
        const float across =
            low[1 - along] +
            width * (static_cast<float>(flat ? line : line - lines) + uniform(1)) / static_cast<float>(lines);
        const float begin =
            low[along] + (static_cast<float>(number % segments) - 2.0f * uniform(2)) * kScanSegment;
        s.active[i] &= begin < high[along] ? -1 : 0;
        s.horizontal[i] = flat ? -1 : 0;
        s.low[i] = low[along], s.high[i] = high[along];
        s.share[i] = width / static_cast<float>(lines);
        // Place the three points on the line
        const auto place = [&](PicturePoint& p, float steps) {
            const float here = begin + steps * kScanSegment;
            p.x[i] = flat ? here : across, p.y[i] = flat ? across : here;
            p.lens_u[i] = uniform(3), p.lens_v[i] = uniform(4);
        };
        place(s.end[0], 0.0f), place(s.chosen, 1.0f), place(s.end[1], 2.0f);
        // All segments of a line choose alike, so that both sides of a small light cancel in sums of pixels
        s.stream[i] = line_stream(static_cast<uint32_t>(tile) ^ hash(task.seed ^ 0x27d4eb2fu), line);
    }
    return s;
}

}  // namespace edgegrad::EDGEGRAD_ISA
