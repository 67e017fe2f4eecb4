// The receiver: the surface that light hits after it passes an edge.
#pragma once

#include "boundary/samples/segment_sampling.h"
#include "path/start.h"
#include "shading/transmittance.h"

namespace edgegrad::EDGEGRAD_ISA {

struct ReceiverHit {
    Mask found;
    Closest hit;
    Vec3 through;  // transmittance on the way over the probability of the choice
};

// The meshes that light meets on its way. Meshes with a bit of `blockers` stop it, and meshes with a bit of
// `seers` can be the receiver. `kind` is the kind of the rays. The random numbers are those of path vertices
// from `first` on.
struct ReceiverRays {
    Int blockers, seers;
    RayKind kind;
    Int first;
};

// The rays to the first receiver of a path: the camera sees it in the lanes `seen`, in others a surface does.
EG_INLINE ReceiverRays receiver_rays(Int blockers, Mask seen, RayKind kind) {
    return {blockers, select(seen, splat(1 << kCameraRay), splat(kScatteredRays)), kind, splat(0)};
}

// Finds the receiver along -towards from a point of an edge. If surfaces on the way are transparent or do not
// stop the light, several receivers are possible, and one of them is chosen at random.
EG_OUTLINE ReceiverHit find_receiver(const SceneView& scene, Mask active, Vec3 point, Vec3 towards,
                                     const Ignored& ignored, const ReceiverRays& rays,
                                     const PathIndex& random) {
    constexpr float kStay = 0.5f;
    ReceiverHit r;
    r.hit = no_hit();
    r.through = one3();
    r.found = splat(0);
    // Handle the common case: the first hit stops the light
    const bool clear = scene.all_flags & kHasTransparency;
    const bool differ = clear || scene.rays_differ || scene.lights.any_linked;
    Float near = splat(0.0f);
    Int passed = splat(0);
    Mask looking = active;
    while (any(looking)) {
        const Closest hit = intersect(scene, looking, point, -towards, near, splat(__builtin_inff()), ignored,
                                      embree::kIncoherent, rays.blockers | rays.seers);
        looking &= hit.hit;
        if (!differ) {
            r.hit = hit;
            r.found = looking;
            return r;
        }
        // Evaluate what the hit surface transmits
        const Int mask = gather(scene.mesh_mask, hit.mesh);
        const Mask sees = (mask & rays.seers) != 0, stops = looking & ((mask & rays.blockers) != 0);
        Vec3 through = one3();
        Float offset = splat(0.0f);
        if (any(looking)) {
            // Shadow rays would meet the surface from the other side.
            const SurfacePoint x = hit_surface(scene, looking, hit, towards);
            offset = x.offset;
            Vec3 passing = zero3();
            if (clear)
                passing = surface_transmittance(
                    scene, x, texture_point(scene, x, -towards, splat(static_cast<int>(rays.kind))));
            through = select(stops, passing, through);
        }
        // Stop here or continue, at random
        const Float chance = sobol_pair(random, vertex_pair(rays.first + passed, kVertexSurvival)).u;
        const Mask open = largest_component(through) > 0.0f;
        const Mask stays = looking & sees & (~open | (chance < kStay)), goes = looking & open & ~stays;
        r.through = select(stays & open, r.through * splat(1.0f / kStay), r.through);
        r.through =
            select(goes, r.through * through * select(sees, splat(1.0f / (1.0f - kStay)), 1.0f), r.through);
        // Keep the hits of lanes that stop
        r.hit = any(r.found) ? select(stays, hit, r.hit) : hit;
        r.found |= stays;
        near = select(goes, hit.distance + 2.0f * offset, near);
        passed = passed + 1;
        looking = goes;
    }
    return r;
}

}  // namespace edgegrad::EDGEGRAD_ISA
