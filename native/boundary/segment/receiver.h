// The surface that light which passes an edge falls on.
#pragma once

#include "boundary/samples/segment_sampling.h"
#include "path/start.h"
#include "shading/transmittance.h"

namespace edgegrad::EDGEGRAD_ISA {

struct LitPoint {
    Mask found;
    Closest hit;
    Vec3 through;  // what surfaces on the way let pass, by the probability of having gone on
};

// What light meets on its way: it is stopped by the meshes with a bit of `blockers`, and seen on those with
// one of `seers`, by rays of `kind`. Random numbers are those of vertices from `first` on.
struct LightsWay {
    Int blockers, seers;
    RayKind kind;
    Int first;
};

// The first surface behind e along -towards that is seen. Light also goes on behind surfaces that don't stop
// it, or not all of it: one of all that it falls on is picked.
EG_OUTLINE LitPoint find_receiver(const SceneView& scene, Mask active, Vec3 point, Vec3 towards,
                                  const Ignored& ignored, const LightsWay& way, const PathIndex& random) {
    constexpr float kStay = 0.5f;
    LitPoint r;
    r.hit.hit = r.hit.face = r.hit.mesh = splat(0);
    r.hit.instance = splat(-1);
    r.hit.b1 = r.hit.b2 = r.hit.distance = splat(0.0f);
    r.through = {splat(1.0f), splat(1.0f), splat(1.0f)};
    r.found = splat(0);
    const bool clear = scene.all_flags & kHasTransparency;
    const bool differ = clear || scene.rays_differ || scene.lights.any_linked;
    Float near = splat(0.0f);
    Int passed = splat(0);
    Mask looking = active;
    while (any(looking)) {
        const Closest hit = intersect(scene, looking, point, -towards, near, splat(__builtin_inff()), ignored,
                                      embree::kIncoherent, way.blockers | way.seers);
        looking &= hit.hit;
        if (!differ) {
            r.hit = hit;
            r.found = looking;
            return r;
        }
        const Int mask = gather(scene.mesh_mask, hit.mesh);
        const Mask sees = (mask & way.seers) != 0, stops = looking & ((mask & way.blockers) != 0);
        Vec3 through = {splat(1.0f), splat(1.0f), splat(1.0f)};
        Float offset = splat(0.0f);
        if (any(looking)) {
            // Shadow rays come from the other side.
            const SurfacePoint x =
                surface_point(scene, looking, hit.face, hit.b1, hit.b2, towards, hit.instance);
            offset = x.offset;
            Vec3 passing = zero3();
            if (clear)
                passing = surface_transmittance(
                    scene, x, texture_point(scene, x, -towards, splat(static_cast<int>(way.kind))));
            through = select(stops, passing, through);
        }
        Float chance, unused;
        sobol_pair(random.stream, random.sample, vertex_pair(way.first + passed, kVertexSurvival), chance,
                   unused);
        const Mask open = largest_component(through) > 0.0f;
        const Mask stays = looking & sees & (~open | (chance < kStay)), goes = looking & open & ~stays;
        r.through = select(stays & open, r.through * splat(1.0f / kStay), r.through);
        r.through =
            select(goes, r.through * through * select(sees, splat(1.0f / (1.0f - kStay)), 1.0f), r.through);
        if (!any(r.found)) {
            r.hit = hit;
        } else {
            r.hit.face = select(stays, hit.face, r.hit.face),
            r.hit.mesh = select(stays, hit.mesh, r.hit.mesh);
            r.hit.instance = select(stays, hit.instance, r.hit.instance);
            r.hit.b1 = select(stays, hit.b1, r.hit.b1), r.hit.b2 = select(stays, hit.b2, r.hit.b2);
            r.hit.distance = select(stays, hit.distance, r.hit.distance);
        }
        r.found |= stays;
        near = select(goes, hit.distance + 2.0f * offset, near);
        passed = passed + 1;
        looking = goes;
    }
    return r;
}

}  // namespace edgegrad::EDGEGRAD_ISA
