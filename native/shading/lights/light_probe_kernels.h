// Kernels of the light probes (tasks/light_probe_task.h at the top).
#pragma once

#include "shading/lights/environment_samples.h"
#include "shading/lights/lights.h"
#include "tasks/light_probe_task.h"

namespace edgegrad::EDGEGRAD_ISA {

EG_INLINE Int probe_rows(int64_t at, Mask active) {
    return select(active, lane_index() + static_cast<int>(at), splat(0));
}

EG_INLINE void scatter(float* out, int64_t at, Mask active, Float value) {
    for (int i = 0; i < W; ++i)
        if (active[i]) out[at + i] = value[i];
}

EG_INLINE void scatter3(float* out, int64_t at, Mask active, Vec3 value) {
    for (int i = 0; i < W; ++i) {
        if (!active[i]) continue;
        float* p = out + 3 * (at + i);
        p[0] = value.x[i], p[1] = value.y[i], p[2] = value.z[i];
    }
}

static void light_samples_kernel(const SceneView& scene, const LightProbes& probes) {
    for (int64_t at = 0; at < probes.count; at += W) {
        const Mask active = first_lanes(static_cast<int>(probes.count - at < W ? probes.count - at : W));
        const Int row = probe_rows(at, active);
        SurfacePoint x;
        x.position = gather3(probes.position, row);
        x.normal = gather3(probes.normal, row);
        x.mesh = splat(0);
        x.face = splat(-1);
        const LightSample s = sample_light(scene, active, x, splat(probes.both_sides ? -1 : 0), splat(0),
                                           gather(probes.u, row), gather(probes.v, row));
        scatter3(probes.w, at, active, s.w);
        scatter3(probes.radiance, at, active, select(s.active, s.radiance, zero3()));
        scatter(probes.r, at, active, s.r);
        scatter(probes.pdf, at, active, s.pdf);
        scatter(probes.geometry, at, active, s.geometry);
    }
}

static void light_directions_kernel(const SceneView& scene, const DirectionProbes& probes) {
    for (int64_t at = 0; at < probes.count; at += W) {
        const Mask active = first_lanes(static_cast<int>(probes.count - at < W ? probes.count - at : W));
        const Int row = probe_rows(at, active);
        Receiver from{zero3(), zero3(), splat(probes.both_sides ? -1 : 0)};
        from.position = gather3(probes.position, row);
        from.normal = gather3(probes.normal, row);
        const Vec3 w = gather3(probes.w, row);
        const Float r = gather(probes.r, row);
        const Int face = gather(probes.face, row);
        const Float pdf = light_pdf(scene, active & (face >= 0), from, face, w, r);
        const Vec3 radiance = lights_along(scene, active, from, splat(0), w, splat(0.0f), r,
                                           gather(probes.bsdf_pdf, row), splat(probes.kind), splat(0));
        scatter(probes.pdf, at, active, pdf);
        scatter3(probes.radiance, at, active, radiance);
    }
}

static void environment_kernel(const SceneView& scene, const EnvironmentProbes& probes) {
    for (int64_t at = 0; at < probes.count; at += W) {
        const Mask active = first_lanes(static_cast<int>(probes.count - at < W ? probes.count - at : W));
        const Int row = probe_rows(at, active);
        EnvironmentSample s{zero3(), zero3(), splat(0.0f)};
        if (probes.u) {
            s = sample_environment(scene, active, gather(probes.u, row), gather(probes.v, row));
            scatter3(probes.w, at, active, s.w);
        } else {
            s.w = gather3(probes.w, row);
            s.radiance = environment_radiance(scene, s.w);
            s.pdf = environment_pdf(scene, s.w);
        }
        scatter3(probes.radiance, at, active, s.radiance);
        scatter(probes.pdf, at, active, s.pdf);
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
