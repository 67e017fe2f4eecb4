// Paths that start at given first hits, not at the camera's.
#pragma once

#include "path/first_rays.h"
#include "path/path_queue.h"
#include "path/run.h"
#include "scene/rays/rays.h"
#include "tasks/boundary_task.h"
#include "tasks/image_task.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// A boundary task's samples as `sets` paths each, one set after the other. A sample's paths have the same
// random numbers, those of `seed`.
EG_INLINE ImageTask sample_paths(const BoundaryTask& task, int sets, uint32_t seed) {
    ImageTask paths{};
    paths.pixel_count = sets;
    paths.first_sample = static_cast<int32_t>(task.first);
    paths.samples = static_cast<int32_t>(task.count);
    paths.max_depth = task.max_depth;
    paths.seed = seed;
    paths.limits = task.limits;
    paths.width = 1;
    paths.one_stream = true;
    return paths;
}

// Appends paths whose rays have met `hit` to a queue of n; its new length. Rays leave them a step `aside`,
// and where `other` has a face, the radiance there is taken off.
EG_INLINE int append_met(Workspace& work, int n, const PathPacket& p, const Closest& hit, Vec3 aside,
                         const Closest& other) {
    HitQueue& hits = work.hits;
    append(hits.face, n, p.active, select(hit.hit, hit.face, splat(-1)));
    append(hits.mesh, n, p.active, hit.mesh);
    append(hits.instance, n, p.active, hit.instance);
    append(hits.b1, n, p.active, hit.b1);
    append(hits.b2, n, p.active, hit.b2);
    append(hits.distance, n, p.active, hit.distance);
    append3(work.edges.aside, n, p.active, aside);
    append(work.edges.other, n, p.active, select(other.hit, other.face, splat(-1)));
    append(work.edges.b1, n, p.active, other.b1);
    append(work.edges.b2, n, p.active, other.b2);
    return append_paths(work.paths, n, p);
}

// The same for camera paths with the numbers `path`, whose rays have met `hit` behind `passed` surfaces that
// let `throughput` through.
EG_INLINE int append_start(Workspace& work, int n, Mask active, Int path, Vec3 origin, Vec3 direction,
                           const Closest& hit, Vec3 aside, const Closest& other, Vec3 throughput, Int passed,
                           int max_depth) {
    PathPacket p = first_segment(max_depth);
    p.active = active;
    p.path = path;
    p.origin = p.from = origin;
    p.direction = p.from_normal = direction;
    p.throughput = throughput;
    p.vertex = passed;
    p.bounces = passed << 24;  // the fourth count (path/path_queue.h)
    return append_met(work, n, p, hit, aside, other);
}

// The same for paths on their ray number `segment` of `kind`, which have been scattered `bounces` times (by
// kind), of which what is scattered where they start is asked for and nothing else: their density makes all
// that the ray itself brings count for nothing beside samples of lights (power_heuristic).
EG_INLINE int append_scattering(Workspace& work, int n, Mask active, Int path, Vec3 origin, Vec3 direction,
                                const Closest& hit, Vec3 aside, Vec3 throughput, Int passed, Int segment,
                                Int bounces, Int kind) {
    PathPacket p;
    p.active = active;
    p.path = path;
    p.origin = p.from = origin;
    p.direction = p.from_normal = direction;
    p.throughput = throughput;
    p.pdf = splat(1e-30f);
    p.segment = segment;
    p.vertex = passed;
    p.bounces = bounces | (passed << 24);
    p.both_sides = p.from_mesh = p.touched = p.led = p.followed = p.caustic = p.past_rim = splat(0);
    p.kind = kind;
    p.final_ray = splat(0);
    Closest none = hit;
    none.hit = splat(0);
    return append_met(work, n, p, hit, aside, none);
}

// Follows the n paths that were appended to a queue; work.radiance then has the light of `paths` paths. Only
// here are starts handed to the path tracer, which forgets them after the first surface: left behind where no
// path was appended, they would be taken for those of the camera's next paths.
EG_INLINE void run_appended(const SceneView& scene, const ImageTask& task, Workspace& work, int n,
                            int64_t paths) {
    for (float* channel : work.radiance) __builtin_memset(channel, 0, sizeof(float) * paths);
    if (n == 0) return;
    work.hits.edges = &work.edges;
    run_paths(scene, task, work, n);
}

}  // namespace edgegrad::EDGEGRAD_ISA
