// Scattering in homogeneous media on the way to a hit (shading/media.h). Along a ray that meets its surface
// after the distance D, with the extinction s_t and the scattering s_s,
//   L = int_0^D exp(-s_t t) s_s int p(w, w') L(x_t, w') dw' dt + exp(-s_t D) L(x_D).
// Each path takes one of the two parts: it is scattered at a sampled distance, or passes to its surface.
#pragma once

#include "path/media/medium_event.h"
#include "path/path_queue.h"
#include "path/recorder.h"
#include "path/scatter.h"
#include "path/stream.h"
#include "path/value_recorder.h"
#include "shading/media.h"
#include "shading/phase_function.h"

namespace edgegrad::EDGEGRAD_ISA {

// Finds the media along rays, which end after `distance`; `boundary`: they are the first ones of boundary
// samples. Returns whether any ray is in a medium. Records them for the next vertex, which is recorded then.
EG_INLINE bool find_media(const SceneView& scene, Workspace& work, const PathPacket& p, Float distance,
                          bool boundary, RayMedia& media) {
    const Mask seen = p.active & (p.kind != splat(kUnseenRay));
    const Mask from_camera = (p.kind == splat(kCameraRay)) & (boundary ? splat(-1) : p.vertex == 0);
    const Float begin = near_plane(scene, seen & from_camera, p.direction);
    RayRecord record;
    if (work.vertices && work.vertices->media.wanted)
        record = {nullptr, &work.vertices->media, static_cast<int32_t>(work.vertices->count), kArrivingRay};
    MediaRecorder recorder(record.media, record);
    media = media_along(scene, seen, p.origin + p.direction * begin, p.direction, distance - begin,
                        record.media ? &recorder : nullptr);
    media.begin = begin;
    const Mask dense = seen & media.dense();
    if (record.media) recorder.keep(dense);
    for (Vec3* field : {&media.extinction, &media.scattering, &media.depth})
        *field = select(dense, *field, zero3());
    return any(dense);
}

// Records the rays of a packet in a medium.
EG_INLINE void record_crossing(const SceneView& scene, Vertex& v, const PathPacket& p, const Closest& hit,
                               const RayMedia& media, const MediumEvent& event) {
    const Mask dense = p.active;
    record_arrival(scene, v, p, hit.hit, hit);
    put(v.face, splat(-1), splat(kInMedium));
    store(v.number, ~p.vertex);
    put(v.passes, dense & ~event.scatters, splat(-1));
    put3(v.medium_extinction, dense, media.extinction);
    put3(v.medium_scattering, dense, media.scattering);
    put(v.medium_forward, dense, media.forward);
    put3(v.medium_weight, dense, event.weight);
    put(v.medium_way, dense, way_so_far(p) + event.way);
}

// Scatters a part of the paths in the media along their rays, and removes them from the packet's active
// lanes. Multiplies the throughput of the others. `moving`: derivatives by positions are recorded. Returns
// the queue's new length.
EG_OUTLINE int cross_medium(const SceneView& scene, const ImageTask& task, Workspace& work, PathPacket& p,
                            const Closest& hit, const RayMedia& media, bool moving, int alive) {
    const PathIndex index = path_index(task, p.path);
    const Mask dense = p.active & media.dense();
    PathPacket inside = p;
    inside.active = dense;
    inside.origin = p.origin + p.direction * media.begin;
    Closest ahead = hit;
    ahead.distance = select(hit.hit, hit.distance - media.begin, splat(__builtin_inff()));
    const bool all = work.vertices && work.vertices->media.wanted;
    const MediumEvent event =
        sample_event(scene, inside, dense & ~p.final_ray, media, ahead.distance, index, all);
    const Mask scatters = dense & event.scatters;
    const Vec3 weight = select(scatters, event.weight * media.scattering, event.weight);
    // Record the event
    Vertex* vertex = nullptr;
    if (work.vertices) {
        vertex = &work.vertices->append<W>();
        record_crossing(scene, *vertex, inside, ahead, media, event);
        keep_touched(*work.vertices, *vertex, moving ? dense : p.touched);
    }
    if (work.values) {
        Values& v = record_values(*work.values, p, dense);
        put3(v.color, dense, weight);
        put3(v.next_gain, dense & ~scatters, one3());
        keep_touched(*work.values, v, p.touched);
    }
    // Scatter paths. Sweeps over values multiply by the event's weight themselves.
    PathPacket part = p;
    part.active = scatters;
    p.throughput = select(dense & ~scatters, p.throughput * weight, p.throughput);
    p.active &= ~scatters;
    if (!any(scatters)) return alive;
    if (!work.values) part.throughput = part.throughput * weight;
    SurfacePoint x;
    x.active = splat(0);
    x.face = x.instance = splat(-1);
    x.b1 = x.b2 = x.length_m = x.offset = splat(0.0f);
    x.side = splat(1.0f);
    x.position = inside.origin + p.direction * select(scatters, event.way, splat(0.0f));
    x.normal = -p.direction;
    x.triangle = {x.position, x.position, x.position};
    x.material = splat(0);
    x.mesh = select(hit.hit, hit.mesh, splat(0));
    const PhaseFunction phase{x.normal, p.direction, media.cosine()};
    return scatter(scene, task, work, part, x, phase, index, splat(0.5f), alive, vertex);
}

}  // namespace edgegrad::EDGEGRAD_ISA
