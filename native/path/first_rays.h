// Camera paths on their first segment.
#pragma once

#include "path/camera_rays.h"
#include "path/lens_sample.h"
#include "path/path_queue.h"
#include "scene/rays/rays.h"

namespace edgegrad::EDGEGRAD_ISA {

// Initializes a packet of camera paths. The caller sets `active`, `path`, the rays and `touched`.
EG_INLINE PathPacket first_segment(int max_depth) {
    PathPacket p;
    p.throughput = one3();
    p.pdf = splat(0.0f);
    p.segment = splat(1);
    p.vertex = p.bounces = splat(0);
    p.kind = splat(kCameraRay);
    p.both_sides = p.from_mesh = p.touched = p.unlit = p.caustic = p.past_rim = splat(0);
    p.led = p.rough = splat(-1);
    p.final_ray = splat(max_depth <= 1 ? -1 : 0);
    return p;
}

// Traces camera rays through the picture point (sx, sy) and a point of the lens. Returns their hits.
EG_INLINE Closest trace_first(const SceneView& scene, PathPacket& p, Float sx, Float sy, Float lens_u,
                              Float lens_v, embree::QueryFlag coherence) {
    const CameraView& camera = scene.camera;
    const CameraRay ray = camera_ray(camera, sx, sy, lens_u, lens_v);
    p.kind = select(in_disc(camera, sx, sy), splat(kCameraRay), splat(kUnseenRay));
    const Float length = sqrt(dot(ray.direction, ray.direction));
    p.origin = p.from = ray.origin;
    p.direction = p.from_normal = p.from_receiving = ray.direction * (1.0f / length);
    return intersect(scene, p.active, p.origin, p.direction, length * camera.clip_start,
                     length * camera.clip_end, ignore_nothing(), coherence, ray_mask(p.kind));
}

}  // namespace edgegrad::EDGEGRAD_ISA
