// Samples segments of edges by weight, and writes splats; shared by all boundary terms.
#pragma once

#include "path/stream.h"
#include "sampling/systematic.h"
#include "tasks/boundary_task.h"
#include "tasks/dropped_samples.h"
#include "tasks/splats.h"

namespace edgegrad::EDGEGRAD_ISA {

struct SegmentSample {
    Mask active;
    Int edge, instance;
    Int cell;       // direction cell, in row-major order
    Mask chained;   // the camera sees x through other surfaces
    Vec3 a, t;      // first end; vector to the second
    Float u0, u1;   // the segment
    Float tau;      // position in the segment, uniform in [0, 1]
    Float density;  // expected number of samples on the segment
    PathIndex random;

    Int light_row() const { return cell; }  // of curves about lights
};

// Places a point of a mesh in the world. `instance` is -1 for meshes that are not instanced.
EG_INLINE void place_point(const SceneView& scene, int32_t instance, float (&p)[3]) {
    if (instance < 0) return;
    const float* m = scene.instance_to_world + 12 * static_cast<int64_t>(instance);
    const float x = p[0], y = p[1], z = p[2];
    for (int r = 0; r < 3; ++r) p[r] = m[4 * r] * x + m[4 * r + 1] * y + m[4 * r + 2] * z + m[4 * r + 3];
}

// An end (0 or 1) of an edge or of an intersection line.
EG_INLINE void edge_end(const SceneView& scene, int32_t edge, int32_t instance, int end, float (&p)[3]) {
    const float* from = scene.is_intersection(edge)
                            ? scene.intersection_ends + 6 * scene.intersection(edge) + 3 * end
                            : scene.vertices + 3 * static_cast<int64_t>(scene.edge_vertices[2 * edge + end]);
    for (int c = 0; c < 3; ++c) p[c] = from[c];
    place_point(scene, instance, p);
}

// An end (0 or 1) of each lane's edge, in the mesh's space.
EG_INLINE Vec3 gather_edge_end(const SceneView& scene, Int edge, int end) {
    Rows vertex;
    for (int i = 0; i < W; ++i)
        vertex[i] = static_cast<int32_t>(scene.edge_vertices[2 * static_cast<int64_t>(edge[i]) + end]);
    return gather3(scene.vertices, vertex);
}

// The first ends of edges or intersection lines, and the vectors to the second ends.
EG_INLINE void gather_edges(const SceneView& scene, Int edge, Int instance, Vec3& a, Vec3& t) {
    const Mask intersection = is_intersection(scene, edge), placed = instance >= 0;
    const Int known = select(intersection, splat(0), edge);
    a = gather_edge_end(scene, known, 0);
    Vec3 b = gather_edge_end(scene, known, 1);
    if (any(placed)) {
        const Placement m = gather_placement(scene, instance);
        a = select(placed, place_point(m, a), a);
        b = select(placed, place_point(m, b), b);
    }
    for (int i = 0; any(intersection) && i < W; ++i) {
        if (!intersection[i]) continue;
        float p[3], q[3];
        edge_end(scene, edge[i], instance[i], 0, p);
        edge_end(scene, edge[i], instance[i], 1, q);
        a.x[i] = p[0], a.y[i] = p[1], a.z[i] = p[2];
        b.x[i] = q[0], b.y[i] = q[1], b.z[i] = q[2];
    }
    t = b - a;
}

// Barycentrics of the points at u of edges, in one face of each. `t` is the face in the mesh's space, and
// `opposite` its corner off the edge. The place along the face's side is found by distance, because welded
// vertices keep several numbers, and an edge may be a part of the side (core/geometry/collinear.py).
EG_INLINE void edge_place(const SceneView& scene, Int edge, Float u, const Triangle& t, Int opposite,
                          Float& b1, Float& b2) {
    const Vec3 a = gather_edge_end(scene, edge, 0), b = gather_edge_end(scene, edge, 1);
    const Mask zero = opposite == 0, one = opposite == 1;
    const Vec3 next = select(zero, t.p1, select(one, t.p2, t.p0));
    const Vec3 side = select(zero, t.p2, select(one, t.p0, t.p1)) - next;
    const Float along = dot(a + (b - a) * u - next, side) / max(dot(side, side), 1e-37f);
    const Float at_last = min(max(along, 0.0f), splat(1.0f)), at_next = 1.0f - at_last;
    b1 = select(zero, at_next, select(one, splat(0.0f), at_last));
    b2 = select(zero, at_last, select(one, at_next, splat(0.0f)));
}

// The random number stream of a boundary term.
EG_INLINE uint32_t boundary_stream(const BoundaryTask& task) {
    return hash(task.seed ^ hash(0x2545f491u + static_cast<uint32_t>(task.kind)));
}

// The positions in the lists that a task's samples have reached.
struct SegmentCursor {
    int64_t entry = 0, share = 0;
};

// The segment of an entry (Candidates::parts) at the fraction `place` of the entry's weight: its direction
// cell, its range of u, and the position in the segment. Cells run in alternating directions from row to row,
// so that consecutive segments are neighbours.
struct EntrySegment {
    int32_t cell;
    float u0, u1;
    double place;
    double count;  // segments of the entry
};
EG_INLINE EntrySegment segment_of_entry(const BoundaryTask& task, int64_t entry, double place) {
    const int32_t n = task.direction_cells, cells = n * n, parts = task.parts[entry],
                  segments = parts * cells;
    place *= segments;
    const int32_t last = segments - 1;
    const int32_t k = !(place > 0.0) ? 0 : place < last ? static_cast<int32_t>(place) : last;
    const int32_t part = k / cells, row = k % cells / n, column = k % n;
    const float from = task.u0[entry], width = (task.u1[entry] - from) / static_cast<float>(parts);
    return {row * n + (row % 2 ? n - 1 - column : column), from + width * static_cast<float>(part),
            from + width * static_cast<float>(part + 1), place - k, static_cast<double>(segments)};
}

// Samples [task.first + at, ...), without the ends of the edges. Sample k lies in the k-th of `total` equal
// parts of the weight. With a guide the parts are equal in the guide, which maps to the weight piecewise
// linearly.
EG_INLINE SegmentSample sample_entry(const BoundaryTask& task, int64_t at, SegmentCursor& cursor) {
    SegmentSample s;
    // Measure the steps between samples and the shares of the guide
    const double mass = task.cumulative[task.entries];
    const double guided = task.guide ? task.guide[task.shares] : mass;
    const double step = guided / static_cast<double>(task.total);
    const double share = mass / static_cast<double>(task.shares);
    s.edge = splat(0);
    s.instance = splat(-1);
    s.cell = s.chained = splat(0);
    s.u0 = s.tau = splat(0.0f);
    // Find the place of each sample in the guide and among the entries
    s.u1 = s.density = splat(1.0f);
    for (int i = 0; i < W; ++i) {
        const int64_t k = at + i;
        s.active[i] = k < task.count ? -1 : 0;
        s.random.sample[i] = static_cast<uint32_t>(task.first + k);
        if (k >= task.count) continue;
        double place = systematic_place(task.first + k, task.seed) * step, density = 1.0 / step;
        if (task.guide) {
            int64_t& j = cursor.share;
            go_to(task.guide, task.shares, place, j);
            const double part = task.guide[j + 1] - task.guide[j];
            place = (static_cast<double>(j) + (place - task.guide[j]) / part) * share;
            density *= part / share;
        }
        int64_t& entry = cursor.entry;
        go_to(task.cumulative, task.entries, place, entry);
        double length = task.cumulative[entry + 1] - task.cumulative[entry];
        double tau = (place - task.cumulative[entry]) / length;
        s.edge[i] = task.edge[entry];
        if (task.instance) s.instance[i] = task.instance[entry];
        s.u0[i] = task.u0[entry];
        s.u1[i] = task.u1[entry];
        if (task.cell) {
            s.cell[i] = task.cell[entry].place();
            s.chained[i] = task.cell[entry].chained() ? -1 : 0;
        }
        // Select the segment and the cell of an entry that has many
        if (task.parts) {
            const EntrySegment segment = segment_of_entry(task, entry, tau);
            s.cell[i] = segment.cell;
            s.u0[i] = segment.u0, s.u1[i] = segment.u1;
            tau = segment.place;
            length /= segment.count;
        }
        s.tau[i] = static_cast<float>(tau < 0.0 ? 0.0 : tau > 1.0 ? 1.0 : tau);
        s.density[i] = static_cast<float>(length * density);
        // Record the segment, for learned weights
        if (task.record.has(task.first + k)) {
            const int64_t at_record = task.record.place(task.first + k);
            task.record.entry[at_record] = static_cast<int32_t>(entry);
            task.record.cell[at_record] = SegmentCell(s.cell[i], s.chained[i]);
            task.record.density[at_record] = s.density[i];
            task.record.u[at_record] = s.u0[i] + (s.u1[i] - s.u0[i]) * s.tau[i];
        }
    }
    // All samples share one low-discrepancy sequence, so that samples of neighbouring segments have
    // stratified numbers.
    s.random.pixel = splat(0);
    s.random.stream = splat(boundary_stream(task));
    return s;
}

// The part of a jump at an edge that its samples count. Edges in one place have samples of the same jumps
// (core/geometry/joint_edges.py).
EG_INLINE Float share_of_edge(const SceneView& scene, Mask active, Int edge) {
    Float share = splat(1.0f);
    for (int i = 0; scene.edge_sharing && i < W; ++i)
        if (active[i] && edge[i] >= 0 && edge[i] < scene.edge_count)
            share[i] = 1.0f / static_cast<float>(scene.edge_sharing[edge[i]]);
    return share;
}

EG_INLINE SegmentSample sample_edge_segment(const SceneView& scene, const BoundaryTask& task, int64_t at,
                                            SegmentCursor& cursor) {
    SegmentSample s = sample_entry(task, at, cursor);
    gather_edges(scene, s.edge, s.instance, s.a, s.t);
    if (scene.edge_sharing && samples_edges(task.kind))
        s.density = s.density / share_of_edge(scene, s.active, s.edge);
    return s;
}

// The positions in the lists of the task's first sample.
EG_INLINE SegmentCursor first_segment(const BoundaryTask& task) {
    SegmentCursor cursor;
    const double mass = task.cumulative[task.entries];
    double place = static_cast<double>(task.first) / static_cast<double>(task.total);
    if (task.guide) {
        cursor.share = last_below(task.guide, task.shares, place * task.guide[task.shares]);
        // Start at the entry where the share begins. The samples advance from there.
        place = static_cast<double>(cursor.share) / static_cast<double>(task.shares);
    }
    cursor.entry = last_below(task.cumulative, task.entries, place * mass);
    return cursor;
}

// Products of larger samples with velocities and adjoints would overflow.
constexpr float kLargestSample = 1e36f;

// The sum of the absolute components. It is not finite if one of them is not.
EG_INLINE Float size_of(Vec3 a) { return abs(a.x) + abs(a.y) + abs(a.z); }

// Keeps the samples of finite size and counts the others. A size contains neither velocities nor adjoints, so
// that both modes drop the same samples.
EG_INLINE Mask keep_finite(const BoundaryTask& task, int64_t at, Mask active, Int edge, Int instance,
                           Float size) {
    const Mask lost = active & ~(size < kLargestSample);
    if (any(lost)) {
        DroppedSamples& d = *task.dropped;
        for (int i = 0; i < W; ++i) {
            if (!lost[i]) continue;
            if (d.count++ == 0) d.first = task.first + at + i, d.place = edge[i], d.instance = instance[i];
        }
    }
    return active & ~lost;
}

// The same; also writes the sizes of a first pass.
EG_INLINE Mask weigh_samples(const BoundaryTask& task, int64_t at, Mask active, Int edge, Int instance,
                             Float size) {
    active = keep_finite(task, at, active, edge, instance, size);
    for (int i = 0; task.score && i < W && at + i < task.count; ++i)
        task.score[task.first + at + i] = active[i] ? size[i] : 0.0f;
    return active;
}

// Records the contributions of samples to the gradient: the moved light times the adjoint. They guide later
// calls only, so that both modes of a call take the same samples.
EG_INLINE void record_contribution(const BoundaryTask& task, int64_t at, Mask active, Vec3 color,
                                   Vec3 adjoint, Float sweep) {
    if (!task.record.contribution) return;
    const Float contribution = abs(dot(color, adjoint)) * sweep;
    for (int i = 0; i < W && at + i < task.count; ++i)
        if (const int64_t k = task.first + at + i; active[i] && task.record.has(k))
            task.record.contribution[task.record.place(k)] = contribution[i];
}

EG_INLINE void write_splats(const BoundaryTask& task, Splats& splats, int64_t at, Mask active, Float x,
                            Float y, Vec3 value) {
    for (int i = 0; i < W && at + i < task.count; ++i) {
        splats.x[at + i] = active[i] ? x[i] : kNowhere;
        splats.y[at + i] = y[i];
        splats.value[0][at + i] = value.x[i];
        splats.value[1][at + i] = value.y[i];
        splats.value[2][at + i] = value.z[i];
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
