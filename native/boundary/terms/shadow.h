// Shadow boundary term: an edge between a receiver and its light.
//
// Formula (S) of the derivations (boundary/segment/segment.h), sampled from the edge outwards (derivations,
// C2, D and E). e(u) is a point of an edge, y a point of a light, and x the first surface behind e along w,
// the direction of light from y:
//   dI = int du int dw  W(x) L(y) sigma (t x w) . (de - lambda dx - (1 - lambda) dy).
// If the camera sees x, W(x) = kappa |n . D| f, with f the BSDF of x towards the camera (times
// |n_s . w|/|n . w| for another shading normal). Otherwise W(x) is estimated by a chain of surfaces to the
// camera (boundary/segment/scattering_chain.h). sigma is the side of the edge's faces. If they are on both
// sides, no light passes the edge. For lights without size, L dw is I/|e - y|^2, or a sun's irradiance.
//
// u is uniform on the sampled segment. The picture's light samplers choose y as they would at a surface in e,
// with densities per solid angle dw (shading/lights/lights.h). Directions to the environment are sampled
// about the edge and by the environment's image.
#pragma once

#include "boundary/segment/occluder.h"
#include "boundary/segment/shadow_balance.h"
#include "boundary/segment/shadow_connection.h"
#include "boundary/segment/silhouette.h"
#include "shading/lights/environment_samples.h"
#include "shading/lights/light_radiance.h"
#include "tasks/boundary_kind.h"
#include "tasks/boundary_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// Samples a direction to the environment from a point of an edge: in the wedges where the edge is a
// silhouette or, half of the time, by the environment's image. The weight uses the density of the mixture
// (balance heuristic).
EG_INLINE Vec3 environment_direction(const SceneView& scene, const BoundaryTask& task, const SegmentSample& p,
                                     Mask parted, Float& density) {
    constexpr float kByImage = 0.5f;
    Vec3 towards = cell_direction(scene, task, p, parted, density);
    if (scene.environment_image.sampled) {
        const Float pick = sobol_pair(p.random, kPairStrategy).v;
        const auto [image_u, image_v] = sobol_pair(p.random, kPairLight);
        const Mask by_image = pick < kByImage;
        towards = select(by_image, sample_environment(scene, p.active, image_u, image_v).w, towards);
        density = (1.0f - kByImage) * density_about(scene, task, p, parted, towards, density) +
                  kByImage * environment_pdf(scene, towards);
        return towards;
    }
    density = density_about(scene, task, p, parted, towards, density);
    return towards;
}

EG_OUTLINE LightSample sample_passing_light(const SceneView& scene, Mask active, const TransparentEdge& edge,
                                            Float u, Float v) {
    return sample_light_for(scene, active, edge, u, v);
}

// The light of a shadow sample. Its radiance is evaluated only after the sample is known to contribute.
struct ShadowLight {
    LightSample sample;
    Float geometry;  // 1/density
    Int blockers;
};

// Samples the light and sets y.
EG_INLINE ShadowLight sample_light_point(const SceneView& scene, const BoundaryTask& task,
                                         const SegmentSample& p, Mask parted, BoundarySegment& s) {
    ShadowLight light;
    if (task.kind == kEnvironmentShadow) {
        Float density;
        s.towards = environment_direction(scene, task, p, parted, density);
        s.distance = splat(__builtin_inff());
        s.y.environment = turns_with_environment(scene);
        light.geometry = 1.0f / max(density, 1e-30f);
        light.blockers = environment_blockers(scene);
        return light;
    }
    const auto [u, v] = sobol_pair(p.random, kPairLight);
    light.sample = sample_passing_light(scene, p.active, {s.point, s.edge}, u, v);
    const LightSample& from = light.sample;
    s.active &= from.active & from.casts_shadow;
    s.towards = from.w;
    s.distance = from.r;
    s.y.face = from.face, s.y.b1 = from.b1, s.y.b2 = from.b2;
    s.y.row = from.row, s.y.kind = from.kind;
    light.geometry = from.geometry;
    light.blockers = from.blockers;
    return light;
}

// The light at an edge (connect_shadow).
struct LightAtEdge {
    ShadowLight& light;
    Mask clear;  // lanes with transparent faces
    Vec3 across;

    EG_INLINE Int blockers() const { return light.blockers; }
    EG_INLINE Int visible_to(const SceneView& scene, const BoundaryTask& task) const {
        return task.kind == kEnvironmentShadow ? splat(scene.environment_mask) : light.sample.visible_to;
    }
    // See boundary/terms/camera_sampled_shadow.h.
    EG_INLINE Mask camera_sampled(const BoundaryTask& task, const BoundarySegment& s, Mask chained) const {
        if (task.kind == kEnvironmentShadow) return chained;
        Mask sized = chained & (s.y.row >= 0);
        for (int i = 0; i < W; ++i) sized[i] &= is_sized(s.y.kind[i]) ? -1 : 0;
        return task.shares_faces ? sized | (chained & (light.sample.face >= 0)) : sized;
    }
    EG_INLINE Float share(const SceneView& scene, const BoundaryTask& task, const SegmentSample& p,
                          const SeenLight& seen, const BoundarySegment& s) const {
        Mask balanced = s.active & s.screen_form;
        const bool environment = task.kind == kEnvironmentShadow;
        if (!environment) balanced &= task.shares_faces ? light.sample.face >= 0 : splat(0);
        if (!(task.tree.mass > 0.0f) || !any(balanced)) return splat(1.0f);
        const Float density = environment ? environment_density(scene, s.towards)
                                          : emitter_density(scene, balanced, s.point, light.sample.face,
                                                            s.towards, light.sample.r);
        const Float weight =
            share_of_edges(scene, s.x, seen.view, s.towards, density, p.t, s.reach,
                           largest_component(seen.scattered), task.tree.mass, task.from_camera);
        return select(balanced, weight, 1.0f);
    }
    EG_INLINE void meet(const SceneView& scene, BoundarySegment& s) const { meet_round_light(scene, s); }
    // The light that arrives from y, over the density of the sample.
    EG_INLINE Vec3 arriving(const SceneView& scene, const BoundaryTask& task, const SegmentSample& p,
                            const CurveExit& exit, const BoundarySegment& s) const {
        Vec3 arrives = from_source(scene, task, exit, s);
        if (any(clear))
            arrives =
                select(clear, arrives * transparent_jump(scene, p, s.active & clear, s.u, across, s.towards),
                       arrives);
        return arrives;
    }

 private:
    EG_INLINE Vec3 from_source(const SceneView& scene, const BoundaryTask& task, const CurveExit& exit,
                               const BoundarySegment& s) const {
        PassingRays rays{light.blockers};
        rays.ignored = exit.ignored;
        if (task.kind == kEnvironmentShadow)
            return environment_radiance(scene, s.towards) * light.geometry *
                   transmittance(scene, s.active, s.point, s.towards, splat(__builtin_inff()), rays);
        light.sample.active = s.active;
        look_up_emission(scene, light.sample);
        const Mask near = s.distance < __builtin_inff(), on_surface = light.sample.face >= 0;
        const Vec3 end =
            select(on_surface, light.sample.end - s.point, s.towards * select(near, s.distance, 1.0f));
        const Float far = select(near, splat(0.99999f), splat(__builtin_inff()));
        return light.sample.radiance * light.geometry *
               transmittance(scene, s.active, s.point, end, far, rays);
    }
};

EG_OUTLINE BoundarySegment sample_shadow(const SceneView& scene, const BoundaryTask& task, int64_t at,
                                         SegmentCursor& cursor, const DerivativeView& requested,
                                         const float* adjoint) {
    BoundarySegment s;
    // Sample a point of an edge and a light
    SegmentSample p = sample_edge_segment(scene, task, at, cursor);
    begin_segment(p, s);
    // Silhouettes have a side sigma. Transparent faces have a jump of transmittance instead.
    const Mask clear = transparent_occluder(scene, s.active, s.edge);
    ShadowLight light = sample_light_point(scene, task, p, parts_light(scene, clear, s.edge), s);
    if (scene.rays_differ || scene.lights.any_linked) {
        Int mesh = mesh_of(scene, edge_face(scene, s.edge));
        s.active &= (gather(scene.mesh_mask, mesh) & light.blockers) != 0;
    }
    // Skip edges that are no silhouette in this direction
    const Vec3 across = cross(p.t, -s.towards);
    p.active = s.active;
    const Float sigma = select(clear, splat(1.0f), occluder_side(scene, p, across));
    s.sweep = across * sigma;
    s.active &= sigma != 0.0f;
    if (!any(s.active)) return s;
    connect_shadow(scene, task, p, exit_of_edge(s), requested, adjoint, (p.u1 - p.u0) / p.density,
                   LightAtEdge{light, clear, across}, s);
    return s;
}

}  // namespace edgegrad::EDGEGRAD_ISA
