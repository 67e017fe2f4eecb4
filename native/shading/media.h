// Homogeneous media in closed meshes and in the space around them. Media that overlap add up, as in Cycles.
//
// A query finds all surfaces along the whole ray, in any order. Each surface of a medium which the ray leaves
// at the distance t adds t to the ray's way within that medium, and each that it enters takes t off again:
// beyond the last surface the ray is outside of all meshes. So no path needs to remember where it is.
#pragma once

#include <algorithm>

#include "scene/rays/filtered_hits.h"
#include "shading/absorption.h"
#include "shading/media_recorder.h"
#include "shading/phase_function.h"

namespace edgegrad::EDGEGRAD_ISA {

// What the media are where a ray starts, and how deep they are up to its end.
struct RayMedia {
    Vec3 extinction, scattering;  // 1/m, at the origin
    Float forward;                // MediumFloat
    Vec3 depth;                   // the integral of the extinction along the ray
    Float begin = splat(0.0f);    // distance from which on the ray is in the media (near_plane)

    EG_INLINE Mask dense() const { return largest_component(extinction) > 0.0f; }
    EG_INLINE Float cosine() const { return mean_cosine(scattering, forward); }
};

struct MediaContext {
    AlongRays along;  // first: Embree passes its address to the filter
    float far[W];     // where the way within the media ends
    float sum[kMediumFloats][W];
    float densest[W];  // the largest extinction of a medium along the ray
    float depth[3][W];
    float length[W];          // of the direction
    MediaRecorder* recorder;  // null: nothing is recorded
};

static void filter_media(const embree::FilterArguments* args) {
    auto* context = reinterpret_cast<MediaContext*>(args->context);
    const SceneView& scene = *context->along.edges.scene;
    const FilteredHits hits(args, context->along);
    const SurfacePoint x =
        surface_point(scene, hits.active, hits.face, hits.b1, hits.b2, hits.direction, hits.instance);
    for (int lane = 0; lane < W; ++lane) {
        if (!hits.active[lane]) continue;
        args->valid[hits.slot[lane]] = 0;
        if (!x.active[lane]) continue;
        const float* row = scene.media + static_cast<ptrdiff_t>(kMediumFloats) * x.material[lane];
        const float sign = x.side[lane] < 0.0f ? 1.0f : -1.0f;
        const float far = context->far[lane], way = hits.way[lane] < far ? hits.way[lane] : far;
        for (int k = 0; k < kMediumFloats; ++k) context->sum[k][lane] += sign * row[k];
        for (int c = 0; c < 3; ++c)
            context->densest[lane] = std::max(context->densest[lane], row[kMediumExtinction + c]);
        for (int c = 0; c < 3; ++c) context->depth[c][lane] += sign * row[kMediumExtinction + c] * way;
        if (context->recorder && is_medium(row))
            context->recorder->add(lane, x.material[lane], sign, sign * way * context->length[lane]);
    }
}

// Records the medium of the space outside. Where it takes all light, up to an infinite distance, nothing is
// left to change.
EG_INLINE void record_world_medium(MediaRecorder& recorder, Mask active, Float way) {
    for (int lane = 0; lane < W; ++lane)
        if (active[lane])
            recorder.add(lane, kWorldMedium, 1.0f, way[lane] < __builtin_inff() ? way[lane] : 0.0f);
}

// The media along rays up to `far` times the direction's length. They are recorded by `recorder`, which keeps
// none yet.
[[maybe_unused]] EG_OUTLINE RayMedia media_along(const SceneView& scene, Mask active, Vec3 origin,
                                                 Vec3 direction, Float far,
                                                 MediaRecorder* recorder = nullptr) {
    MediaContext context;
    const Float length = sqrt(dot(direction, direction));
    context.along.start(scene, ignore_nothing(), direction);
    context.recorder = recorder;
    store(context.far, far);
    store(context.length, length);
    do {
        if (recorder) recorder->start();
        for (auto& row : context.sum) store(row, splat(0.0f));
        for (auto& row : context.depth) store(row, splat(0.0f));
        store(context.densest, splat(0.0f));
        if (scene.bvh && any(active)) {
            alignas(64) int32_t valid[W];
            store(valid, active);
            Ray ray;
            set_ray(ray, origin, direction, splat(0.0f), splat(__builtin_inff()), splat(-1));
            embree::QueryArguments args;
            args.context = &context.along.edges.bricks.base;
            args.flags |= embree::kInvokeArgumentFilter;
            args.filter = context.along.edges.bricks.filter = filter_media;
            query_occluded(scene, valid, ray, args);
        }
        if (recorder && is_medium(scene.world_medium)) record_world_medium(*recorder, active, far * length);
    } while (recorder && recorder->needs_room());
    // Add the medium of the space outside. Sums that are as small as their rounding, or negative since a ray
    // along an edge has missed a face, are no medium.
    const float* world = scene.world_medium;
    const Float rounding = 1e-5f * load(context.densest);
    const auto at_origin = [&](int k) {
        const Float own = load(context.sum[k]);
        return select(own > rounding, own, splat(0.0f)) + world[k];
    };
    const auto depth = [&](int c) {
        Float own = max(load(context.depth[c]), splat(0.0f)) * length;
        if (world[kMediumExtinction + c] > 0.0f) own = own + far * length * world[kMediumExtinction + c];
        return own;
    };
    return {
        {at_origin(kMediumExtinction), at_origin(kMediumExtinction + 1), at_origin(kMediumExtinction + 2)},
        {at_origin(kMediumScattering), at_origin(kMediumScattering + 1), at_origin(kMediumScattering + 2)},
        load(context.sum[kMediumForward]) + world[kMediumForward],
        {depth(0), depth(1), depth(2)}};
}

// The distance at which rays from the camera, in the lanes of a mask, begin. As in Cycles, media before the
// near plane have no effect. 0 for other rays.
EG_INLINE Float near_plane(const SceneView& scene, Mask from_camera, Vec3 direction) {
    const CameraView& camera = scene.camera;
    const Float along = is_panorama(camera.kind) ? splat(1.0f) : -dot(splat3(camera.back), direction);
    return select(from_camera, camera.clip_start / max(along, 1e-6f), splat(0.0f));
}

// The share of light that media keep along rays up to `far` times the direction's length.
EG_INLINE Vec3 kept_by_media(const SceneView& scene, Mask active, Vec3 origin, Vec3 direction, Float far,
                             const RayRecord& record = {}) {
    if (!scene.any_medium || !any(active)) return one3();
    MediaRecorder recorder(record.media, record);
    const RayMedia media =
        media_along(scene, active, origin, direction, far, record.media ? &recorder : nullptr);
    if (record.media) recorder.keep(active);
    return select(active, kept_over(media.depth), one3());
}

// The same from the distance `begin` on, along the segment of the length `distance` from `origin` to the
// surface point x, whose material may absorb light too.
EG_INLINE Vec3 kept_on_segment(const SceneView& scene, const SurfacePoint& x, Int closure, Vec3 origin,
                               Float distance, Float begin) {
    const Vec3 w = (x.position - origin) * (1.0f / distance);
    return kept_inside(scene, x, closure, distance) *
           kept_by_media(scene, x.active, origin + w * begin, w, distance - begin);
}
EG_INLINE bool attenuates(const SceneView& scene) {
    return scene.any_medium || (scene.all_flags & kHasAbsorption);
}

}  // namespace edgegrad::EDGEGRAD_ISA
