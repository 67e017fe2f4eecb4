// Places that light has to reach to be seen: vertices of a few paths of the picture, by which edges are
// weighted (boundary/samples/edge_reach.h).
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

}  // namespace edgegrad::EDGEGRAD_ISA
