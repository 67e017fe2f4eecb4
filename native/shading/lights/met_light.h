// A sample of the sized lights of the table that a ray from a surface meets.
#pragma once

#include "shading/lights/light_samples.h"

namespace edgegrad::EDGEGRAD_ISA {

// Samples one of the sized lights of the table along w, all with equal probability (reservoir sampling).
// `kind` is the kind of the rays that find them, `bounces` the number before x, `count` the inverse of that
// probability.
EG_OUTLINE LightSample sample_met_light(const SceneView& scene, Mask active, const SurfacePoint& x, Vec3 w,
                                        Int kind, Int bounces, Float u, Float& count) {
    const LightView& lights = scene.lights;
    LightSample s = no_light_sample(scene, splat(0), splat(0), splat(-1), splat(0));
    s.w = w;
    s.r = count = splat(0.0f);
    s.distant = splat(0);
    const auto meet = [&](int row, Mask seen, const LightRow&, Float distance, Float) EG_INLINE_LAMBDA {
        count = count + select(seen, splat(1.0f), 0.0f);
        const Float share = 1.0f / max(count, 1.0f);
        const Mask taken = seen & (u < share);
        u = select(seen, select(taken, u * count, (u - share) / max(1.0f - share, 1e-6f)), u);
        const int light_kind = lights.kind[lights.light_of_row[row]];
        s.row = select(taken, splat(row), s.row);
        s.kind = select(taken, splat(light_kind), s.kind);
        s.r = select(taken, distance, s.r);
        s.distant = select(taken, splat(light_kind >= kDirectionLight ? -1 : 0), s.distant);
    };
    for_each_met_light(scene, active, x.position, x.mesh, w, splat(0.0f), splat(__builtin_inff()), kind,
                       bounces, meet);
    s.active = s.row >= 0;
    if (any(s.active)) {
        const Int row = select(s.active, s.row, splat(0));
        take_links(lights, s.active, row, gather_light(lights, row).flags, s);
    }
    s.end = x.position + w * select(s.distant, splat(1.0f), s.r);
    return s;
}

}  // namespace edgegrad::EDGEGRAD_ISA
