// Transmittance between two points: the product of the transparent shares of the surfaces between them.
#pragma once

#include "scene/rays/rays.h"
#include "shading/absorption.h"
#include "shading/media.h"
#include "shading/surface_transmittance.h"
#include "shading/transparent_recorder.h"

namespace edgegrad::EDGEGRAD_ISA {

// Parameters of a transmittance query.
struct PassingRays {
    Int mask;                        // ray mask of the meshes
    RayKind kind = kShadowRay;       // for textures
    int most_transparent = 1 << 30;  // surfaces; rays end behind more
    Ignored ignored = ignore_nothing();
    RayRecord record{};
};

// Context of a shadow query whose filter multiplies transmittances.
struct ShadowContext {
    AlongRays along;  // first: Embree passes its address to the filter
    RayKind kind;
    int32_t left[W];  // transparent surfaces that the ray may still pass
    float through[3][W];
    float absorbed[3][W];           // the exponent of Beer's law, in scenes with absorption
    TransparentRecorder* recorder;  // null: nothing is recorded
};

static void filter_transparent(const embree::FilterArguments* args) {
    auto* context = reinterpret_cast<ShadowContext*>(args->context);
    const SceneView& scene = *context->along.edges.scene;
    ignore_edge_faces(args);
    const FilteredHits hits(args, context->along);
    // Evaluate the surfaces' transmittances
    const SurfacePoint x =
        surface_point(scene, hits.active, hits.face, hits.b1, hits.b2, hits.direction, hits.instance);
    const Float length = sqrt(dot(hits.direction, hits.direction));
    const TexturePoint point = texture_point(scene, x, hits.direction * (-1.0f / max(length, 1e-30f)),
                                             splat(static_cast<int>(context->kind)));
    const Vec3 through = surface_transmittance(scene, x, point);
    Mask absorbs = splat(0);
    Vec3 absorbed = zero3();
    if (scene.all_flags & kHasAbsorption) {
        absorbed =
            absorption_of(scene, hits.active, gather(scene.material_first_closure, x.material), absorbs);
        absorbed = absorbed * (hits.way * length * select(x.side < 0.0f, splat(1.0f), -1.0f));
    }
    // Multiply or record the transmittances, and let the rays continue
    for (int lane = 0; lane < W; ++lane) {
        if (!hits.active[lane]) continue;
        const float t[3] = {through.x[lane], through.y[lane], through.z[lane]};
        TransparentRecorder* const recorder = context->recorder;
        const int32_t changes = recorder ? recorder->changes(scene, x.material[lane]) : 0;
        const bool dark = !(t[0] > 0.0f || t[1] > 0.0f || t[2] > 0.0f);
        // A hit that stays valid ends the query.
        if (dark && !(changes && recorder->goes_on(lane, changes))) continue;
        if (context->left[lane]-- <= 0) continue;
        if (changes)
            recorder->add(lane, hits.face[lane], hits.instance[lane], hits.b1[lane], hits.b2[lane]);
        else
            for (int c = 0; c < 3; ++c) context->through[c][lane] *= t[c];
        if (absorbs[lane]) {
            context->absorbed[0][lane] += absorbed.x[lane];
            context->absorbed[1][lane] += absorbed.y[lane];
            context->absorbed[2][lane] += absorbed.z[lane];
        }
        args->valid[hits.slot[lane]] = 0;
    }
}

// Transmittance of the surfaces along rays up to `far` times the direction's length, except for recorded
// ones.
EG_OUTLINE Vec3 through_surfaces(const SceneView& scene, Mask active, Vec3 origin, Vec3 direction, Float far,
                                 const PassingRays& rays) {
    const Vec3 white = one3();
    if (!(scene.all_flags & kHasTransparency)) {
        const Mask hidden = occluded(scene, active, origin, direction, far, rays.ignored, rays.mask);
        return select(hidden, zero3(), white);
    }
    if (!any(active)) return zero3();
    alignas(64) int32_t valid[W];
    Ray ray;
    ShadowContext context;
    context.along.start(scene, rays.ignored, direction);
    context.kind = rays.kind;
    TransparentRecorder recorder(rays.record.surfaces, rays.record);
    context.recorder = rays.record.surfaces ? &recorder : nullptr;
    embree::QueryArguments args;
    args.context = &context.along.edges.bricks.base;
    args.flags |= embree::kInvokeArgumentFilter;
    args.filter = context.along.edges.bricks.filter = filter_transparent;
    do {
        store(valid, active);
        set_ray(ray, origin, direction, splat(0.0f), far, rays.mask);
        store(context.left, splat(rays.most_transparent));
        for (auto& channel : context.through) store(channel, splat(1.0f));
        for (auto& channel : context.absorbed) store(channel, splat(0.0f));
        if (context.recorder) recorder.start();
        query_occluded(scene, valid, ray, args);
    } while (context.recorder && recorder.needs_room());
    const Mask open = active & ~(load(ray.tfar) < 0.0f);
    if (context.recorder) recorder.keep(open);
    Vec3 through = {load(context.through[0]), load(context.through[1]), load(context.through[2])};
    if (scene.all_flags & kHasAbsorption) {
        const auto kept = [&](int c) { return exp(min(-load(context.absorbed[c]), splat(0.0f))); };
        through = through * Vec3{kept(0), kept(1), kept(2)};
    }
    return select(open, through, zero3());
}

// The same of surfaces and media.
EG_INLINE Vec3 transmittance(const SceneView& scene, Mask active, Vec3 origin, Vec3 direction, Float far,
                             const PassingRays& rays) {
    const Vec3 through = through_surfaces(scene, active, origin, direction, far, rays);
    if (!scene.any_medium) return through;
    const Mask open = active & (largest_component(through) > 0.0f);
    return through * kept_by_media(scene, open, origin, direction, far, rays.record);
}

}  // namespace edgegrad::EDGEGRAD_ISA
