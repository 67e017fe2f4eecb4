// Places that light has to reach to be seen: vertices of a few paths of the picture. And how much of the
// light that passes edges reaches them (boundary/samples/edge_reach.h).
#pragma once

#include "boundary/samples/picture_cell.h"
#include "boundary/terms/camera_sampled.h"
#include "tasks/boundary_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// The vertex of each sample's path that is written: the first one of every second path, the second one of
// every second path among the others, and so on, up to the last one that may scatter light. `share`: the part
// of the paths.
EG_INLINE Int seen_vertex(Int sample, int max_depth, Float& share) {
    Int vertex = splat(1);
    share = splat(1.0f);
    for (int k = 1; k < max_depth - 1; ++k) {
        const Mask here = vertex == k, stays = here & (((sample >> (k - 1)) & 1) == 0);
        share = select(here, 0.5f * share, share);
        vertex = vertex - (here & ~stays);
    }
    return vertex;
}

// Writes the place of each sample.
EG_OUTLINE void find_seen_places(const SceneView& scene, const BoundaryTask& task, SeenPlaces& out) {
    const ImageTask walks = camera_sampled_paths(task);
    SegmentCursor cursor = first_segment(task);
    for (int64_t at = 0; at < task.count; at += W) {
        const SegmentSample p = sample_entry(task, at, cursor);
        const Int sample = lane_index() + static_cast<int32_t>(task.first + at);
        Float sx, sy, share;
        place_in_cell(scene, task, p, sx, sy);
        const Int vertex = seen_vertex(sample, task.max_depth, share);
        Closest hit;
        PathPacket path = start_walk(scene, task, p.active, sample, sx, sy, p.random, hit);
        walk_camera_paths(scene, walks, path, hit, vertex);
        const Vec3 t = path.throughput;
        const Float light = (abs(t.x) + abs(t.y) + abs(t.z)) * (1.0f / 3.0f);
        store3(out.position, at, path.origin + path.direction * select(path.active, hit.distance, 0.0f));
        store(out.weight + at, select(path.active, light / share, 0.0f));
    }
}

// The reach of points. Sets the squared distance to the nearest place, for light in the same directions.
struct PointReach {
    Float reach, nearest2;
};
// Adds light that arrives at e and goes on to the places. distance2(way): the square of how far it passes
// one.
template <typename Distance2>
EG_INLINE void add_places(const EdgeReachTask& task, Vec3 e, Float arrives, const Distance2& distance2,
                          PointReach& out) {
    for (int32_t k = 0; k < task.places; ++k) {
        const Vec3 way =
            Vec3{splat(task.position[0][k]), splat(task.position[1][k]), splat(task.position[2][k])} - e;
        const Float r2 = min(distance2(way) + task.size2[k], splat(1e37f));
        out.reach = out.reach + arrives * task.weight[k] / r2;
        out.nearest2 = min(out.nearest2, r2);
    }
}
EG_INLINE PointReach reach_in_all_directions(const EdgeReachTask& task, Vec3 e) {
    PointReach out{splat(0.0f), splat(1e37f)};
    add_places(task, e, splat(1.0f), [](Vec3 way) EG_INLINE_LAMBDA { return dot(way, way); }, out);
    return out;
}
// Light of lamps and suns travels along one ray from e.
EG_INLINE PointReach reach_of_lights(const EdgeReachTask& task, Vec3 e) {
    PointReach out{splat(0.0f), splat(1e37f)};
    Float all = splat(1e-30f);
    for (int32_t j = 0; j < task.light_count; ++j) {
        const LightNode& n = task.lights[j];
        Vec3 travels = splat3(n.axis);
        Float arrives = splat(n.power > 1e-20f ? n.power : 1e-20f), spread = splat(n.sin_o);
        if (n.radius >= 0.0f) {
            const Vec3 way = e - splat3(n.center);
            const Float distance = sqrt(dot(way, way)), r = max(distance + n.radius, 1e-15f);
            arrives = max(n.power / (r * r) + n.by_way / r + n.by_way2, splat(1e-20f));
            spread = n.radius / r, travels = way * (1.0f / max(distance, 1e-15f));
        }
        all = all + arrives;
        const auto distance2 = [&](Vec3 way) EG_INLINE_LAMBDA {
            const Float along = max(dot(way, travels), splat(0.0f)), penumbra = spread * along;
            const Vec3 beside = way - travels * along;
            return dot(beside, beside) + penumbra * penumbra;
        };
        add_places(task, e, arrives, distance2, out);
    }
    out.reach = out.reach / all;
    return out;
}

// Writes the mean reach over each segment.
EG_OUTLINE void find_edge_reach(const SceneView& scene, const EdgeReachTask& task) {
    constexpr float kMostPoints = 64.0f;
    const auto reach = [&](Vec3 e) EG_INLINE_LAMBDA {
        return task.lights ? reach_of_lights(task, e) : reach_in_all_directions(task, e);
    };
    for (int64_t at = 0; at < task.count; at += W) {
        Vec3 a, t;
        gather_edges(scene, load(task.edge + at), task.instance ? load(task.instance + at) : splat(-1), a, t);
        const Float u0 = load(task.u0 + at), length = load(task.u1 + at) - u0;
        a = a + t * u0, t = t * length;
        const PointReach middle = reach(a + t * splat(0.5f));
        // A short segment is like its middle. On others take the mean of several points.
        const Float parts = sqrt(dot(t, t) / middle.nearest2);
        Float mean = middle.reach;
        const Mask is_long = parts > 1.0f;
        if (any(is_long)) {
            Float count = min(2.0f * parts, splat(kMostPoints)), sum = splat(0.0f);
            count = to_float(to_int(max(count, splat(1.0f))));
            for (int k = 0; any(is_long & (count > static_cast<float>(k))); ++k) {
                const Mask here = count > static_cast<float>(k);
                const Float place = min((static_cast<float>(k) + 0.5f) / count, splat(1.0f));
                sum = sum + select(here, reach(a + t * place).reach, splat(0.0f));
            }
            mean = select(is_long, sum / count, mean);
        }
        store(task.reach + at, mean);
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
