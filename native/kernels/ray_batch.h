// Many rays through the engine's own queries, for measuring them (python/probes/ray_queries.cpp).
#pragma once

#include "scene/rays/rays.h"
#include "tasks/probe_tasks.h"

namespace edgegrad::EDGEGRAD_ISA {

static void ray_batch_kernel(const SceneView& scene, const RayBatch& rays, int32_t* face, float* distance) {
    for (int64_t at = 0; at < rays.count; at += W) {
        const Mask active = first_lanes(static_cast<int>(rays.count - at < W ? rays.count - at : W));
        const Vec3 o = {load(rays.origin[0] + at), load(rays.origin[1] + at), load(rays.origin[2] + at)};
        const Vec3 d = {load(rays.direction[0] + at), load(rays.direction[1] + at),
                        load(rays.direction[2] + at)};
        const Float far = load(rays.far + at);
        if (rays.brute_force) {
            const BruteHit hit =
                rays.shadow
                    ? brute_force<true>(scene, active, o, d, splat(0.0f), far, ignore_nothing(), splat(-1))
                    : brute_force<false>(scene, active, o, d, splat(0.0f), far, ignore_nothing(), splat(-1));
            for (int i = 0; i < W; ++i)
                face[at + i] =
                    hit.hit[i] ? (rays.shadow ? 0 : scene.brute_triangles[hit.triangle[i]].face) : -1;
            store(distance + at, hit.distance);
        } else if (rays.shadow) {
            const Mask hidden = occluded(scene, active, o, d, far, ignore_nothing());
            store(face + at, select(hidden, splat(0), splat(-1)));
        } else {
            const Closest hit = intersect(scene, active, o, d, splat(0.0f), far, ignore_nothing(),
                                          rays.coherent ? embree::kCoherent : embree::kIncoherent);
            store(face + at, select(hit.hit, hit.face, splat(-1)));
            store(distance + at, hit.distance);
        }
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
