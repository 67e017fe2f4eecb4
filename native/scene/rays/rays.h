// Ray queries: packets of W rays through Embree.
#pragma once

#include "scene/rays/brute_force.h"
#include "sdf/trace.h"
#include "simd/lanes.h"

namespace edgegrad::EDGEGRAD_ISA {

// Up to this many triangles, testing each is faster than Embree's BVH, for the nearest hit and for any hit. A
// wider packet shares each test among more rays, while the BVH gains less from width.
constexpr int32_t kBruteNearest = 6 * W, kBruteAny = 2 * W;

EG_INLINE bool test_all(const SceneView& scene, int32_t most) {
    return scene.brute_count > 0 && scene.brute_count <= most;
}

using RayHit = embree::RayHit<W>;
using Ray = embree::Ray<W>;

// Context of a query whose filter ignores the faces of an edge, per lane.
struct EdgeContext {
    BrickContext bricks;  // first: Embree passes its address to the filter
    const SceneView* scene;
    int32_t edge[W];
    int32_t instance[W];  // of the edge
};

// Faces are ignored by a filter within the traversal. Re-tracing behind an ignored hit would skip coplanar
// surfaces (derivations F3e). Ray ids are lane numbers. Collinear faces lie on edges, so that rounding would
// decide whether rays through the edges hit them.
static void ignore_edge_faces(const embree::FilterArguments* args) {
    const auto* context = reinterpret_cast<const EdgeContext*>(args->context);
    const SceneView& scene = *context->scene;
    const auto* ray = static_cast<const uint32_t*>(args->ray);
    const auto* hit = static_cast<const uint32_t*>(args->hit);
    const uint32_t n = args->n;
    // Usually few lanes have a hit, so a branch per lane would be mispredicted.
    uint32_t waiting = n == W ? lane_bits(load(args->valid)) : (1u << n) - 1u;
    for (; waiting; waiting &= waiting - 1u) {
        const uint32_t i = static_cast<uint32_t>(__builtin_ctz(waiting));
        if (!args->valid[i]) continue;
        const uint32_t lane = ray[10 * n + i];
        const int32_t edge = context->edge[lane];
        if (edge < 0) continue;
        const uint32_t face = hit[5 * n + i] + static_cast<uint32_t>(scene.mesh_first_face[hit[6 * n + i]]);
        const uint32_t number = hit[7 * n + i];  // Embree's index of the instance
        const int32_t copy =
            number == embree::kInvalidId ? -1 : static_cast<int32_t>(number) - scene.mesh_count;
        const uint32_t first = scene.edge_face_first[edge];
        for (uint32_t k = first; k < scene.edge_face_first[edge + 1]; ++k)
            if (scene.edge_faces[k] == face &&
                face_instance(scene, edge, context->instance[lane], k - first) == copy)
                args->valid[i] = 0;
        if (scene.face_collinear && scene.face_collinear[face]) args->valid[i] = 0;
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
    args.user_function = intersect_brick;
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
    args.user_function = occlude_brick;
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
    Int face;            // 0 without a hit
    Int mesh, instance;  // instance -1: none
    Float b1, b2;
    Float distance;  // in units of the direction's length
};

EG_INLINE Closest no_hit() {
    const Float zero = splat(0.0f);
    return {splat(0), splat(0), splat(0), splat(-1), zero, zero, zero};
}

EG_INLINE Closest select(Mask m, const Closest& a, const Closest& b) {
    return {select(m, a.hit, b.hit),           select(m, a.face, b.face), select(m, a.mesh, b.mesh),
            select(m, a.instance, b.instance), select(m, a.b1, b.b1),     select(m, a.b2, b.b2),
            select(m, a.distance, b.distance)};
}

// The surface that rays along `direction` have hit.
EG_INLINE SurfacePoint hit_surface(const SceneView& scene, Mask active, const Closest& hit, Vec3 direction) {
    SurfacePoint x = surface_point(scene, active, hit.face, hit.b1, hit.b2, direction,
                                   select(active, hit.instance, splat(-1)));
    x.mesh = select(active, hit.mesh, splat(0));
    return x;
}

// The position of a hit on its face.
EG_INLINE Vec3 hit_position(const SceneView& scene, Mask active, const Closest& hit,
                            const PlacedTriangle& face) {
    Triangle t = face.triangle;
    Float b1 = hit.b1, b2 = hit.b2;
    settle_on_fields(scene, active, hit.face, t, b1, b2);
    return interpolate(t, b1, b2);
}

EG_INLINE void set_filter(const SceneView& scene, const Ignored& ignored, EdgeContext& context,
                          embree::QueryArguments& args) {
    args.context = &context.bricks.base;
    if (!any(ignored.edge >= 0)) return;
    context.scene = &scene;
    store(context.edge, ignored.edge);
    store(context.instance, ignored.instance);
    args.flags |= embree::kInvokeArgumentFilter;
    args.filter = ignore_edge_faces;
}

// The mask of the meshes and lights that rays of a kind meet, also Embree's.
EG_INLINE Int ray_mask(Int kind) {
    Int mask;
    for (int i = 0; i < W; ++i) mask[i] = 1 << meets_as(kind[i]) & ~(1 << kUnseenRay);
    return mask;
}

// Finds the nearest hit among meshes that have a bit of `mask`.
EG_INLINE Closest intersect(const SceneView& scene, Mask active, Vec3 origin, Vec3 direction, Float near,
                            Float far, const Ignored& ignored, int coherence,
                            Int mask = splat(1 << kCameraRay)) {
    if (test_all(scene, kBruteNearest)) {
        const BruteHit hit = brute_force<false>(scene, active, origin, direction, near, far, ignored, mask);
        Int face = splat(0), mesh = splat(0);
        for (int i = 0; i < W; ++i) {
            face[i] = scene.brute_triangles[hit.triangle[i]].face;
            mesh[i] = scene.brute_triangles[hit.triangle[i]].mesh;
        }
        return {hit.hit, face & hit.hit, mesh & hit.hit, splat(-1), hit.b1, hit.b2, hit.distance};
    }
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
    const auto column = [](const uint32_t* p) { return load(reinterpret_cast<const int32_t*>(p)); };
    const Int geometry = column(rays.hit.geom_id), instance = column(rays.hit.inst_id);
    const Int none = splat(static_cast<int>(embree::kInvalidId));
    Closest closest;
    closest.hit = active & (geometry != none);
    closest.mesh = select(closest.hit, geometry, splat(0));
    closest.instance = select(closest.hit & (instance != none), instance - scene.mesh_count, splat(-1));
    closest.face =
        select(closest.hit, gather(scene.mesh_first_face, closest.mesh) + column(rays.hit.prim_id), splat(0));
    closest.b1 = select(closest.hit, load(rays.hit.u), 0.0f);
    closest.b2 = select(closest.hit, load(rays.hit.v), 0.0f);
    closest.distance = select(closest.hit, load(rays.ray.tfar), far);
    return closest;
}

// Origin of a ray that leaves a surface, offset along its normal by more than the rounding error.
EG_INLINE Vec3 leave_surface(const SurfacePoint& x) { return x.position + x.normal * x.offset; }

// Embree's flag for rays of nearly one direction, as towards a small light from nearby points. A packet of
// such rays traverses the BVH together; for diverging rays this would be slower.
EG_INLINE int coherence(Mask active, Vec3 direction) {
    constexpr float kCosine2 = 0.96f;
    const int lane = first_lane(active);
    const Vec3 one = {splat(direction.x[lane]), splat(direction.y[lane]), splat(direction.z[lane])};
    const Float along = dot(direction, one);
    const Float least = dot(direction, direction) * (kCosine2 * dot(one, one));
    const Mask parts = active & ((along < 0.0f) | (along * along < least));
    return any(parts) ? embree::kIncoherent : embree::kCoherent;
}

// Lanes that hit something in the BVH within `far` times the direction's length.
EG_OUTLINE Mask occluded_in_bvh(const SceneView& scene, Mask active, Vec3 origin, Vec3 direction, Float far,
                                const Ignored& ignored, Int mask) {
    alignas(64) int32_t valid[W];
    store(valid, active);
    Ray ray;
    set_ray(ray, origin, direction, splat(0.0f), far, mask);
    EdgeContext context;
    embree::QueryArguments args;
    args.flags = coherence(active, direction);
    set_filter(scene, ignored, context, args);
    query_occluded(scene, valid, ray, args);
    return active & (load(ray.tfar) < 0.0f);  // Embree sets -inf where it found a hit
}

// Lanes that hit something within `far` times the direction's length.
EG_INLINE Mask occluded(const SceneView& scene, Mask active, Vec3 origin, Vec3 direction, Float far,
                        const Ignored& ignored, Int mask = splat(1 << kShadowRay)) {
    if (!any(active)) return active;
    if (test_all(scene, kBruteAny))
        return brute_force<true>(scene, active, origin, direction, splat(0.0f), far, ignored, mask).hit;
    return occluded_in_bvh(scene, active, origin, direction, far, ignored, mask);
}

}  // namespace edgegrad::EDGEGRAD_ISA
