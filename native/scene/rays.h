// Ray queries: packets of W rays through Embree, and the one place where rays leave a surface.
#pragma once

#include "scene/geometry.h"

namespace edgegrad::EDGEGRAD_ISA {

using RayHit = embree::RayHit<W>;
using Ray = embree::Ray<W>;

// Context of a query whose filter ignores, per lane, the faces of an edge.
struct EdgeContext {
    embree::QueryContext base;  // first: Embree passes its address to the filter
    const SceneView* scene;
    int32_t edge[W];
    int32_t face[W];  // one more to ignore, or -1
};

// Ignoring faces is a filter in the traversal: re-tracing behind an ignored hit would step over
// surfaces that lie in the same plane (derivations F3e). Ray ids are lane numbers.
static void ignore_edge_faces(const embree::FilterArguments* args) {
    const auto* context = reinterpret_cast<const EdgeContext*>(args->context);
    const SceneView& scene = *context->scene;
    const auto* ray = static_cast<const uint32_t*>(args->ray);
    const auto* hit = static_cast<const uint32_t*>(args->hit);
    const uint32_t n = args->n;
    for (uint32_t i = 0; i < n; ++i) {
        if (!args->valid[i]) continue;
        const uint32_t lane = ray[10 * n + i];
        const int32_t edge = context->edge[lane];
        if (edge < 0) continue;
        const uint32_t face = hit[5 * n + i] + static_cast<uint32_t>(scene.mesh_first_face[hit[6 * n + i]]);
        if (static_cast<int32_t>(face) == context->face[lane]) args->valid[i] = 0;
        for (uint32_t k = scene.edge_face_first[edge]; k < scene.edge_face_first[edge + 1]; ++k)
            if (scene.edge_faces[k] == face) args->valid[i] = 0;
    }
}

EG_INLINE void set_ray(Ray& ray, Vec3 origin, Vec3 direction, Float near, Float far, Int mask) {
    store(ray.org_x, origin.x), store(ray.org_y, origin.y), store(ray.org_z, origin.z);
    store(ray.dir_x, direction.x), store(ray.dir_y, direction.y), store(ray.dir_z, direction.z);
    store(ray.tnear, near), store(ray.tfar, far);
    for (int i = 0; i < W; ++i) {
        ray.time[i] = 0.0f;
        ray.mask[i] = static_cast<uint32_t>(mask[i]);
        ray.id[i] = static_cast<uint32_t>(i);
        ray.flags[i] = 0;
    }
}

EG_INLINE void query_intersect(const SceneView& scene, const int32_t* valid, RayHit& rays,
                               embree::QueryArguments& args) {
    if constexpr (W == 16)
        scene.api->intersect16(valid, scene.bvh, &rays, &args);
    else if constexpr (W == 8)
        scene.api->intersect8(valid, scene.bvh, &rays, &args);
    else if constexpr (W == 4)
        scene.api->intersect4(valid, scene.bvh, &rays, &args);
    else if (valid[0])
        scene.api->intersect1(scene.bvh, &rays, &args);
}

EG_INLINE void query_occluded(const SceneView& scene, const int32_t* valid, Ray& ray,
                              embree::QueryArguments& args) {
    if constexpr (W == 16)
        scene.api->occluded16(valid, scene.bvh, &ray, &args);
    else if constexpr (W == 8)
        scene.api->occluded8(valid, scene.bvh, &ray, &args);
    else if constexpr (W == 4)
        scene.api->occluded4(valid, scene.bvh, &ray, &args);
    else if (valid[0])
        scene.api->occluded1(scene.bvh, &ray, &args);
}

struct Closest {
    Mask hit;
    Int face;            // 0 where there is no hit
    Int mesh, instance;  // instance -1: the mesh itself
    Float b1, b2;
    Float distance;  // in units of the direction's length
};

EG_INLINE void set_filter(const SceneView& scene, const Ignored& ignored, EdgeContext& context,
                          embree::QueryArguments& args) {
    args.context = &context.base;
    if (!any(ignored.edge >= 0)) return;
    context.scene = &scene;
    store(context.edge, ignored.edge);
    store(context.face, ignored.face);
    args.flags |= embree::kInvokeArgumentFilter;
    args.filter = ignore_edge_faces;
}

// What rays of a kind meet: a mask for Embree.
EG_INLINE Int ray_mask(Int kind) {
    Int mask;
    for (int i = 0; i < W; ++i) mask[i] = 1 << kind[i];
    return mask;
}

// Nearest hit, of the meshes that have a bit of `mask`.
EG_INLINE Closest intersect(const SceneView& scene, Mask active, Vec3 origin, Vec3 direction, Float near,
                            Float far, const Ignored& ignored, int coherence,
                            Int mask = splat(1 << kCameraRay)) {
    alignas(64) int32_t valid[W];
    store(valid, active);
    RayHit rays;
    set_ray(rays.ray, origin, direction, near, far, mask);
    for (int i = 0; i < W; ++i) {
        rays.hit.geom_id[i] = embree::kInvalidId;
        rays.hit.inst_id[i] = embree::kInvalidId;
    }
    EdgeContext context;
    embree::QueryArguments args;
    args.flags = coherence;
    set_filter(scene, ignored, context, args);
    query_intersect(scene, valid, rays, args);
    Closest closest;
    for (int i = 0; i < W; ++i) {
        const bool hit = valid[i] && rays.hit.geom_id[i] != embree::kInvalidId;
        closest.hit[i] = hit ? -1 : 0;
        closest.mesh[i] = hit ? static_cast<int32_t>(rays.hit.geom_id[i]) : 0;
        closest.instance[i] = hit && rays.hit.inst_id[i] != embree::kInvalidId
                                  ? static_cast<int32_t>(rays.hit.inst_id[i]) - scene.mesh_count
                                  : -1;
        closest.face[i] =
            hit ? scene.mesh_first_face[closest.mesh[i]] + static_cast<int32_t>(rays.hit.prim_id[i]) : 0;
        closest.b1[i] = hit ? rays.hit.u[i] : 0.0f;
        closest.b2[i] = hit ? rays.hit.v[i] : 0.0f;
        closest.distance[i] = hit ? rays.ray.tfar[i] : far[i];
    }
    return closest;
}

// Where rays leave a surface: off along its normal, further than rounding can be wrong.
EG_INLINE Vec3 leave_surface(const SurfacePoint& x) { return x.position + x.normal * x.offset; }

// Whether something is hit within `far` times the direction's length.
EG_INLINE Mask occluded(const SceneView& scene, Mask active, Vec3 origin, Vec3 direction, Float far,
                        const Ignored& ignored, Int mask = splat(1 << kShadowRay)) {
    if (!any(active)) return active;
    alignas(64) int32_t valid[W];
    store(valid, active);
    Ray ray;
    set_ray(ray, origin, direction, splat(0.0f), far, mask);
    EdgeContext context;
    embree::QueryArguments args;
    set_filter(scene, ignored, context, args);
    query_occluded(scene, valid, ray, args);
    return active & (load(ray.tfar) < 0.0f);  // Embree sets -inf where it found a hit
}

EG_INLINE Mask occluded_from(const SceneView& scene, Mask active, const SurfacePoint& x, Vec3 direction,
                             Float far) {
    return occluded(scene, active, leave_surface(x), direction, far, x.ignored);
}

}  // namespace edgegrad::EDGEGRAD_ISA
