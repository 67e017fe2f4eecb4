// The surface that a ray towards a light-scattering surface meets.
#pragma once

#include "boundary/samples/visible_edge.h"

namespace edgegrad::EDGEGRAD_ISA {

// A surface that scatters light.
struct LightSource {
    Closest hit;
    Mask escapes;  // rays that leave the scene
    Float distance;
    Vec3 aside;  // offset from the surface to where rays leave it
    // The transmittance and the number of transparent surfaces in front of it.
    Vec3 through;
    Int passed;
};

// Finds the first such surface along a ray. Transparent surfaces are passed at random, at most
// `most_transparent` of them. The path tracer's random numbers decide, so that both make the same choices.
EG_OUTLINE LightSource meet_source(const SceneView& scene, Mask active, Vec3 origin, Vec3 direction,
                                   const Ignored& ignored, const PathIndex& random, int most_transparent) {
    const Int kind = splat(static_cast<int>(kDiffuseRay));
    LightSource y;
    y.through = {splat(1.0f), splat(1.0f), splat(1.0f)};
    y.passed = splat(0);
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
        if (scene.all_flags & kHasTransparency) {
            SurfacePoint x = surface_point(scene, hit.hit, hit.face, hit.b1, hit.b2, direction, hit.instance);
            x.mesh = hit.mesh;
            const TexturePoint point = texture_point(scene, x, -direction, kind);
            Float choice, chance, unused;
            sobol_pair(random.stream, random.sample, vertex_pair(y.passed, kVertexChoice), choice, unused);
            sobol_pair(random.stream, random.sample, vertex_pair(y.passed, kVertexSurvival), unused, chance);
            const Shader shader = surface_shader(scene, x, point, choice);
            Vec3 color;
            pass = x.active & has(shader, kHasTransparency) & (chance < passing_share(shader, color));
            y.through = select(pass, y.through * color * shader.scale, y.through);
            near = select(pass, hit.distance + 2.0f * x.offset, near);
            y.passed = y.passed - pass;
        }
        // Keep the hits of rays that stop
        const Mask stays = looking & hit.hit & ~pass;
        y.escapes |= looking & ~hit.hit;
        if (any(found)) {
            y.hit.face = select(stays, hit.face, y.hit.face),
            y.hit.mesh = select(stays, hit.mesh, y.hit.mesh);
            y.hit.instance = select(stays, hit.instance, y.hit.instance);
            y.hit.b1 = select(stays, hit.b1, y.hit.b1), y.hit.b2 = select(stays, hit.b2, y.hit.b2);
            y.hit.distance = select(stays, hit.distance, y.hit.distance);
        } else {
            y.hit = hit;
        }
        found |= stays;
        looking &= pass & (y.passed < most_transparent);
        if (!any(looking)) break;
    }
    y.hit.hit = found;
    y.distance = select(found, y.hit.distance, 0.0f);
    return y;
}

}  // namespace edgegrad::EDGEGRAD_ISA
