// Paths that start at given first hits instead of camera rays.
#pragma once

#include "path/first_rays.h"
#include "path/path_queue.h"
#include "path/run.h"
#include "scene/rays/rays.h"
#include "shading/absorption.h"
#include "shading/media.h"
#include "tasks/boundary_task.h"
#include "tasks/image_task.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// Describes a boundary task's samples as `sets` paths per sample, one set after the other. All paths of a
// sample use the same random numbers, those of `seed`.
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

// Appends paths whose rays have met `hit` to a queue of n paths. Returns the queue's new length. Rays leave
// the hits with an offset of `aside`. Where `other` has a face, the radiance at `other` is subtracted.
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

// The same without another face beside the hit.
EG_INLINE int append_met(Workspace& work, int n, const PathPacket& p, const Closest& hit, Vec3 aside) {
    Closest none = hit;
    none.hit = splat(0);
    return append_met(work, n, p, hit, aside, none);
}

// Appends camera paths with the numbers `path`. Their rays have met `hit` behind `passed` transparent
// surfaces, whose transmittance is `throughput`.
EG_INLINE int append_start(Workspace& work, int n, Mask active, Int path, Vec3 origin, Vec3 direction,
                           const Closest& hit, Vec3 aside, const Closest& other, Vec3 throughput, Int passed,
                           int max_depth) {
    PathPacket p = first_segment(max_depth);
    p.active = active;
    p.path = path;
    p.origin = p.from = origin;
    p.direction = p.from_normal = p.from_receiving = direction;
    p.throughput = throughput;
    p.vertex = passed;
    p.bounces = passed << 24;  // the fourth count (path/path_queue.h)
    return append_met(work, n, p, hit, aside, other);
}

// The share of light from `hit` along w that arrives after a `distance` beyond the origin of a path that
// starts on the way.
EG_INLINE Vec3 kept_before_start(const SceneView& scene, Mask active, const Closest& hit, Vec3 origin, Vec3 w,
                                 Float distance) {
    const Vec3 all = kept_by_media(scene, active, origin, -w, distance);
    if (!(scene.all_flags & kHasAbsorption)) return all;
    const SurfacePoint y = hit_surface(scene, active, hit, w);
    return all * kept_inside(scene, y, gather(scene.material_first_closure, y.material), distance);
}

// Appends paths that estimate only the light scattered at `hit`. Their ray is segment number `segment`, of
// kind `kind`, after `bounces` (counts by kind). The tiny density gives light that the ray itself finds a
// weight of zero (power_heuristic).
EG_INLINE int append_scattering(Workspace& work, int n, Mask active, Int path, Vec3 origin, Vec3 direction,
                                const Closest& hit, Vec3 aside, Vec3 throughput, Int passed, Int segment,
                                Int bounces, Int kind) {
    PathPacket p;
    p.active = active;
    p.path = path;
    p.origin = p.from = origin;
    p.direction = p.from_normal = p.from_receiving = direction;
    p.throughput = throughput;
    p.pdf = splat(1e-30f);
    p.segment = segment;
    p.vertex = passed;
    p.bounces = bounces | (passed << 24);
    p.both_sides = p.from_mesh = p.touched = p.led = p.rough = p.unlit = p.caustic = p.past_rim = splat(0);
    p.kind = kind;
    p.final_ray = splat(0);
    return append_met(work, n, p, hit, aside);
}

// Traces the n paths that were appended to a queue. Afterwards work.radiance holds the radiance of `paths`
// paths. `hits.edges` is set only here, and the path tracer resets it after the first surface. If it stayed
// set without an appended path, the next camera paths would use it.
EG_INLINE void run_appended(const SceneView& scene, const ImageTask& task, Workspace& work, int n,
                            int64_t paths) {
    for (float* channel : work.radiance) __builtin_memset(channel, 0, sizeof(float) * paths);
    if (n == 0) return;
    work.hits.edges = &work.edges;
    run_paths(scene, task, work, n);
}

}  // namespace edgegrad::EDGEGRAD_ISA
