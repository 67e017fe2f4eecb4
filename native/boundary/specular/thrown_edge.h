// Edges before light that narrow lobes throw on other surfaces (path/lights/thrown_light.h).
//
// These lobes have a fixed microfacet normal only for light of the table and of the environment. So at the
// edge e the jump is that of this light behind it alone, which the edge's faces hide on one side. Light of
// other surfaces keeps its direction, and its jumps are those of the indirect term
// (boundary/terms/indirect.h).
#pragma once

#include "boundary/samples/visible_edge.h"
#include "boundary/specular/chain_surface.h"
#include "path/path_queue.h"
#include "shading/lights/environment.h"
#include "shading/lights/lights.h"

namespace edgegrad::EDGEGRAD_ISA {

// Crossings whose last vertex throws light on the one before it by a narrow lobe.
EG_INLINE Mask is_thrown(const ChainCrossings& c, int at, int count) {
    const Int length = load(c.length + at);
    Int last = splat(0), before = splat(0);
    for (int level = 0; level + 1 < kMostChain; ++level) {
        const Mask here = length == level + 2;
        if (!any(here)) continue;
        before = select(here, load(c.event[level] + at), before);
        last = select(here, load(c.event[level + 1] + at), last);
    }
    return first_lanes(count - at) & (before == kEventAims) & (last >= 0) & ((last & kEventFollows) != 0);
}

// L- - L+ of the lights behind the edge, along the rays of the path `p` from `ray`.
EG_OUTLINE Vec3 jump_of_thrown(const SceneView& scene, const EdgeSample& s, const Sides& sides,
                               const Behind& behind, const ChainRay& ray, const PathPacket& p) {
    const Mask plus = sides.plus.face >= 0, minus = sides.minus.face >= 0, one = s.active & (plus ^ minus);
    if (!any(one)) return zero3();
    const Float start = length_of(ray.origin - ray.from);
    const Receiver from{ray.from, p.from_normal, splat(0), nullptr};
    Vec3 light = lights_along(scene, one, from, p.from_mesh, ray.direction, start + s.view.distance,
                              select(behind.hit.hit, start + behind.hit.distance, splat(__builtin_inff())),
                              splat(0.0f), p.kind, bounces_before_last(p), p.lobe);
    const Mask open = one & ~behind.hit.hit & ((splat(scene.environment_mask) & ray_mask(p.kind)) != 0);
    if (scene.has_environment && any(open))
        light = select(open, light + environment_radiance(scene, ray.direction), light);
    return select(one, light * select(plus, splat(1.0f), splat(-1.0f)), zero3());
}

}  // namespace edgegrad::EDGEGRAD_ISA
