// The surface that a ray towards a light-scattering surface meets.
#pragma once

#include "boundary/samples/visible_edge.h"

namespace edgegrad::EDGEGRAD_ISA {

// A surface that scatters light, and the transparent ones in front of it.
struct LightSource : PassedSurfaces {
    Closest hit;
    Mask escapes;  // rays that leave the scene
    Float distance;
    Vec3 aside;  // offset from the surface to where rays leave it
};

// Finds the first such surface along a ray. Transparent surfaces are passed at random, at most
// `most_transparent` of them. The path tracer's random numbers decide, so that both make the same choices.
EG_OUTLINE LightSource meet_source(const SceneView& scene, Mask active, Vec3 origin, Vec3 direction,
                                   const Ignored& ignored, const PathIndex& random, int most_transparent) {
    LightSource y;
    y.aside = zero3();
    Mask looking = active, found = splat(0);
    y.escapes = splat(0);
    Float near = splat(0.0f);
    while (true) {
        // Find the next surface along each ray
        Closest hit = intersect(scene, looking, origin, direction, near, splat(__builtin_inff()), ignored,
                                embree::kIncoherent, splat(kScatteredRays));
        Mask pass = splat(0);
        // Pass transparent surfaces at random
        if (scene.all_flags & kHasTransparency)
            pass = passes(scene, hit.hit, hit, direction, kDiffuseRay, random, y, near);
        // Keep the hits of rays that stop
        const Mask stays = looking & hit.hit & ~pass;
        y.escapes |= looking & ~hit.hit;
        y.hit = any(found) ? select(stays, hit, y.hit) : hit;
        found |= stays;
        looking &= pass & (y.passed < most_transparent);
        if (!any(looking)) break;
    }
    y.hit.hit = found;
    y.distance = select(found, y.hit.distance, 0.0f);
    return y;
}

}  // namespace edgegrad::EDGEGRAD_ISA
