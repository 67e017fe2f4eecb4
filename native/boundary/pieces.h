// Sampling of boundary pieces by mass, shared by all boundary terms, and their splats.
#pragma once

#include "path/stream.h"

namespace edgegrad::EDGEGRAD_ISA {

struct PieceSample {
    Mask active;
    Int edge;
    Vec3 a, t;      // first vertex, and from it to the second
    Float u0, u1;   // the piece
    Float tau;      // place along the piece, uniform in [0, 1]
    Float density;  // expected number of samples on the piece
    PathIndex random;
};

// Samples [task.first + at, …): number k lies in the k-th of `total` equal shares of the mass.
EG_INLINE PieceSample sample_piece(const SceneView& scene, const BoundaryTask& task, int64_t at,
                                   int64_t& piece) {
    PieceSample s;
    const double step = task.cumulative[task.pieces] / static_cast<double>(task.total);
    s.edge = splat(0);
    s.u0 = s.tau = splat(0.0f);
    s.u1 = s.density = splat(1.0f);
    for (int i = 0; i < W; ++i) {
        const int64_t k = at + i;
        s.active[i] = k < task.count ? -1 : 0;
        const uint32_t number = static_cast<uint32_t>(task.first + k);
        s.random.sample[i] = number;
        if (k >= task.count) continue;
        const double jitter =
            static_cast<double>(hash(number ^ hash(task.seed ^ 0x51ed270bu)) >> 8) * 5.9604645e-8;
        const double place = (static_cast<double>(task.first + k) + jitter) * step;
        while (piece + 1 < task.pieces && task.cumulative[piece + 1] <= place) ++piece;
        const double mass = task.cumulative[piece + 1] - task.cumulative[piece];
        const double tau = (place - task.cumulative[piece]) / mass;
        s.edge[i] = task.edge[piece];
        s.u0[i] = task.u0[piece];
        s.u1[i] = task.u1[piece];
        s.tau[i] = static_cast<float>(tau < 0.0 ? 0.0 : tau > 1.0 ? 1.0 : tau);
        s.density[i] = static_cast<float>(mass / step);
    }
    // One low-discrepancy sequence over all samples: neighbouring shares of the mass get stratified
    // random numbers.
    s.random.pixel = splat(0);
    s.random.stream = splat(hash(task.seed ^ (task.environment ? 0x6b2fb644u : 0x2545f491u)));
    for (int i = 0; i < W; ++i) {
        const uint32_t* ends = scene.edge_vertices + 2 * static_cast<int64_t>(s.edge[i]);
        const float* p = scene.vertices + 3 * static_cast<int64_t>(ends[0]);
        const float* q = scene.vertices + 3 * static_cast<int64_t>(ends[1]);
        s.a.x[i] = p[0], s.a.y[i] = p[1], s.a.z[i] = p[2];
        s.t.x[i] = q[0] - p[0], s.t.y[i] = q[1] - p[1], s.t.z[i] = q[2] - p[2];
    }
    return s;
}

// First piece whose mass reaches beyond the task's first sample.
EG_INLINE int64_t first_piece(const BoundaryTask& task) {
    const double place =
        static_cast<double>(task.first) * (task.cumulative[task.pieces] / static_cast<double>(task.total));
    int64_t low = 0, high = task.pieces;
    while (high - low > 1) {
        const int64_t mid = (low + high) / 2;
        (task.cumulative[mid] <= place ? low : high) = mid;
    }
    return low;
}

// Pixel that a direction of unit depth goes through; lanes outside of the picture become inactive.
EG_INLINE Int pixel_of(const CameraView& c, Vec3 direction, Mask& active) {
    const Float x = dot(splat3(c.right), direction) * c.focal + c.principal[0];
    const Float y = c.principal[1] - dot(splat3(c.up), direction) * c.focal;
    active &=
        (x >= 0.0f) & (y >= 0.0f) & (x < static_cast<float>(c.width)) & (y < static_cast<float>(c.height));
    return select(active, to_int(y) * c.width + to_int(x), splat(0));
}

EG_INLINE void write_splats(const BoundaryTask& task, Splats& splats, int64_t at, Mask active, Int pixel,
                            Vec3 value) {
    for (int i = 0; i < W && at + i < task.count; ++i) {
        splats.pixel[at + i] = active[i] ? pixel[i] : -1;
        splats.value[0][at + i] = value.x[i];
        splats.value[1][at + i] = value.y[i];
        splats.value[2][at + i] = value.z[i];
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
