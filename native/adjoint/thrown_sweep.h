// Light of the table and of the environment that narrow lobes throw on other surfaces
// (path/lights/thrown_light.h).
#pragma once

#include "adjoint/incident_light.h"
#include "path/shaded_surface.h"
#include "shading/bsdf/perfect_lobes.h"

namespace edgegrad::EDGEGRAD_ISA {

// The BSDF's value `all` for light from w, without the share that lobes in `throws` throw
// (path/lights/thrown_light.h).
template <typename Surface, typename Evaluate>
EG_INLINE Vec3 without_thrown(const Surface& surface, Mask active, Int throws, Vec3 w, Vec3 all,
                              const Evaluate& evaluate) {
    if constexpr (requires { surface.bsdf; }) {
        active &= throws != 0;
        if (!any(active)) return all;
        Surface rest = surface;
        follow_lobes(rest.bsdf, throws);
        const Vec3 f = evaluate(rest, active);
        return select(active, all + (f - all) * share_above(dot(surface.bsdf.ng, w)), all);
    }
    return all;
}

// What one lobe of a surface throws at the microfacet normal `half`.
struct Thrown {
    Vec3 w;      // towards the light
    Vec3 value;  // f |cos| by the measure D(h) dh, times the share
};

EG_INLINE Thrown throw_by(const ShadedSurface& surface, const SurfacePoint& x, Mask active, Int lobe,
                          Vec3 half) {
    ShadedSurface throwing = surface;
    follow_lobes(throwing.bsdf, splat(1) << lobe);
    const Specular s = scatter_specular(throwing.bsdf, lobe, splat(0), active, half);
    Vec3 value = s.value * share_above(dot(x.normal, s.wi));
    if (surface.smooth || surface.dims) value = value * surface.shown(s.wi);
    return {s.wi, value};
}

// The light that the sampled lobes of a packet's vertices throw from x.
inline Vec3 thrown_light(const SceneView& scene, const Vertex& v, const ShadedSurface& surface,
                         const SurfacePoint& x, const Scattering& s) {
    Vec3 sum = zero3();
    // Light of the table, of the row that the sample has met
    if (any(s.thrown)) {
        const Mask coat = (load(v.thrown) & (1 << kCoatLobe)) != 0;
        const Int lobe = select(coat, splat(kCoatLobe), splat(kMirrorLobe));
        const Thrown t = throw_by(surface, x, s.thrown, lobe, load3(v.thrown_half));
        const Int own_row = load(v.light_row);
        Vec3 light = zero3();
        for_each_met_light(
            scene, s.thrown, x.position, x.mesh, t.w, splat(0.0f), splat(__builtin_inff()), splat(kGlossyRay),
            splat(0), [&](int row, Mask seen, const LightRow& l, Float distance, Float) {
                light = select(seen & (own_row == row), l.radiance * light_factor(l, t.w, distance), light);
            });
        sum = select(s.thrown, t.value * light * load3(v.light_scale) * s.kept, sum);
    }
    // The environment, where the continuing ray meets nothing
    if (any(s.thrown_beyond)) {
        const Thrown t = throw_by(surface, x, s.thrown_beyond, load(v.lobe), load3(v.half));
        const Vec3 light = environment_radiance(scene, t.w) * load(v.thrown_scale);
        sum = sum + select(s.thrown_beyond, t.value * light, zero3());
    }
    return sum;
}

}  // namespace edgegrad::EDGEGRAD_ISA
