// Paths that are scattered once along the rim of a transmission lobe (shading/bsdf/transmission_rim.h), of a
// rough diffuse lobe (shading/bsdf/diffuse_rim.h) or of lit gloss (path/shaded_surface.h). They estimate the
// derivative due to the motion of rims, for transmission lobes
//   dL = sign(1 - eta) int f |n.w| L(w) (dg/dtheta)/eta dphi   over the rim g(w) = 0   (derivations, O).
//
// The paths are recorded like those of the interior term, with `VertexMemory::rims`. At a surface whose lobe
// has a rim, a path is scattered along the rim with probability `kRimChance`, or 1 at its last scattering
// event. Before and after it is scattered like any other path. At that vertex, sweeps (adjoint/vertex.h)
// replace f |cos| by f |cos| g, whose value is zero and whose derivative is that of the rim. Other vertices
// contribute only the light that they send there. Thus everything that moves a rim is on the tape that
// shading uses.
//
// The ray along the rim finds light of surfaces and of the environment with a weight of 1, because no emitter
// sample lies on a rim. Recorded rays do not meet sized lights of the light table. Those are sampled
// explicitly: along the ray, or, on rims in a plane, in the arcs in which they cut it. These are the rims of
// diffuse lobes and of lit gloss, which scatters no other light there.
#pragma once

#include <utility>

#include "path/scatter.h"
#include "path/shaded_surface.h"
#include "shading/lights/light_arc.h"
#include "shading/lights/met_light.h"
#include "tasks/image_task.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// Probability of scattering along the rim where the path may be scattered again.
constexpr float kRimChance = 0.5f;
// Density of rays along a rim: the weight of other strategies vanishes beside it (power_heuristic).
constexpr float kRimDensity = 1e18f;

// The lanes that are scattered along a rim here.
struct RimChoice {
    Mask taken;
    Float others;      // weight of the lanes that are scattered otherwise
    Float u;           // remainder of the random number of the choice
    Float chance;      // probability of the choice
    Int rim;           // the Rim
    RimSample sample;  // in world space
};

EG_OUTLINE RimChoice choose_rims(const SceneView& scene, const ImageTask& task, const PathPacket& p,
                                 const ShadedSurface& surface, const PathIndex& index) {
    RimChoice r;
    r.others = splat(1.0f);
    r.u = r.chance = splat(0.0f);
    r.taken = r.rim = splat(0);
    r.sample = {splat(0), surface.normal, splat(1.0f)};
    const Bsdf& f = surface.bsdf;
    // The domain of a followed lobe moves with it, but for light that its rays do not meet.
    Mask through = splat(0);
    if (f.any_lobe[kInterfaceLobe])
        through = has_rim(f.glass, f.view) &
                  (~f.glass.facets.followed | (widest_alpha(f.glass.facets) > scene.least_followed));
    // Nothing behind this vertex moves the rim of its lit gloss.
    const Mask lit = scene.lights.all_sized() > 0 ? p.touched & surface.has_gloss_rim() : splat(0);
    const std::pair<Rim, Mask> rims[] = {
        {kDiffuseRim, has_diffuse_rim(f)}, {kTransmissionRim, through}, {kGlossRim, lit}};
    Int count = splat(0);
    for (const auto& [rim, has] : rims) count = count - has;
    const Mask may = p.active & ~p.past_rim & (count > 0);
    if (!any(may)) return r;
    // Emitter samples do not use these random numbers before the rim.
    const auto [choice, place] = sobol_pair(index, vertex_pair(p.vertex, kVertexLight));
    const Mask last = p.segment + 1 >= task.max_depth;
    r.chance = select(last, splat(1.0f), splat(kRimChance));
    r.taken = may & (choice < r.chance);
    r.u = choice / max(r.chance, kRimChance);
    r.others = select(may & ~r.taken, splat(1.0f / (1.0f - kRimChance)), 1.0f);
    // Choose one of its rims
    const Float number = max(to_float(count), 1.0f);
    const Int chosen = to_int(min(r.u * number, number - 1.0f));
    Int before = splat(0);
    for (const auto& [rim, has] : rims) {
        r.rim = select(has & (before == chosen), splat(rim), r.rim);
        before = before - has;
    }
    r.u = fract(r.u * number);
    r.chance = r.chance / number;
    // Sample a direction of rims along which rays continue
    if (any(may & (r.rim == splat(kDiffuseRim)))) r.sample = sample_diffuse_rim(f, place);
    if (const Mask cone = may & (r.rim == splat(kTransmissionRim)); any(cone)) {
        const RimSample s = sample_rim(f.glass, f.view, place);
        r.sample = {select(cone, s.active, r.sample.active), select(cone, to_world(f, s.w), r.sample.w),
                    select(cone, s.pdf, r.sample.pdf)};
    }
    r.sample.active &= r.rim != splat(kGlossRim);
    return r;
}

// Scatters paths along their rims. Returns the queue's new length.
EG_OUTLINE int scatter_at_rim(const SceneView& scene, const ImageTask& task, Workspace& work, PathPacket p,
                              const SurfacePoint& x, const ShadedSurface& surface, const RimChoice& r,
                              int alive, Vertex& vertex) {
    // Evaluate the lobe at its rim
    const Vec3 w = r.sample.w;
    const Bsdf& bsdf = surface.bsdf;
    const Mask diffuse = r.rim == splat(kDiffuseRim), cone = r.rim == splat(kTransmissionRim),
               lit = r.rim == splat(kGlossRim);
    const auto reaches = [&](Vec3 towards) {
        const Float side = dot(x.normal, towards);
        return lit | select(diffuse, side > 0.0f, side < 0.0f);
    };
    const Mask in_plane = p.active & r.taken & ~cone;
    p.active &= r.taken & r.sample.active & reaches(w);
    Vec3 f = diffuse_rim_value(bsdf, w);
    if (any(p.active & cone)) f = select(cone, rim_value(bsdf.glass, bsdf.view, to_local(bsdf, w)), f);
    f = f * surface.kept_at_rim(w);
    p.active &= largest_component(f) > 0.0f;
    if (!any(p.active | in_plane)) return alive;
    put(vertex.rim, p.active | in_plane, r.rim);
    const Int kind = select(diffuse, splat(kDiffuseRay), splat(kTransmissionRay));
    // Sample the lights of the table along the rim: those that the ray meets, or the arc in which a light
    // meets the rim's plane
    const Mask through = p.active & cone;
    const Float share = 1.0f / max(r.chance, kRimChance / 3.0f), scale = share / r.sample.pdf;
    Mask followed = splat(0);
    if (bsdf.any_lobe[kInterfaceLobe]) followed = through & bsdf.glass.facets.followed;
    if (scene.lights.all_sized() > 0) {
        Float count;
        LightSample s = sample_met_light(scene, through, x, w, kind, bounces_before(p), r.u, count);
        Float light = scale * count;
        if (any(in_plane)) {
            const Vec3 normal = select(lit, unbent_normal(surface), surface.normal);
            const LightSample arc = sample_light_arc(scene, in_plane, x.position, normal, x.face, r.u);
            s = select(in_plane, arc, s);
            const Int glossy = select(dot(x.normal, s.w) > 0.0f, splat(kGlossyRay), splat(kTransmissionRay));
            const Mask seen = (s.visible_to & ray_mask(select(lit, glossy, kind))) != 0;
            s.active &=
                (s.row >= 0) &
                (~in_plane | (shines_on(scene, s.row, x.mesh, bounces_before(p)) & seen & reaches(s.w)));
            if (const Mask some = s.active & lit; any(some))
                s.active &= ~lit | (largest_component(surface.unhidden_gloss(some, s.w)) > 0.0f);
            light = select(in_plane, share * s.geometry, light);
        }
        if (any(s.active & followed))
            s.active &=
                ~followed | (widest_alpha(bsdf.glass.facets) > followed_for(scene, s.active, s.row).widest);
        if (any(s.active)) {
            const Vec3 start = leave_surface(x, s.w) + terminator_lift(scene, x, unbent_normal(surface), s.w);
            const Vec3 seen =
                transmittance(scene, s.active & s.casts_shadow, start, select(s.distant, s.w, s.end - start),
                              select(s.distant, splat(__builtin_inff()), 0.99999f),
                              shadow_rays(work, &vertex, kRayToLight, s.blockers));
            record_light(vertex, s, select(s.casts_shadow, seen, one3()) * light);
        }
    }
    p.active &= ~followed;
    if (!any(p.active)) return alive;
    // Continue along the rim and record the direction
    put(vertex.samples, p.active, splat(-1));
    put(vertex.continues, p.active, splat(-1));
    put(vertex.transmitted, p.active, cone);
    put3(vertex.next_direction, p.active, w);
    put(vertex.next_scale, p.active, scale);
    p.final_ray = next_is_final(task, p, kind);
    p.throughput = p.throughput * f * scale;
    p.lobe = {};
    p.past_rim = splat(-1);
    p.led = splat(0);
    p.both_sides = surface.both_sides() | cone;
    leave(p, x, receiving_normal(scene, x, unbent_normal(surface)), w, kind, splat(kRimDensity));
    return append_paths(work.paths, alive, p);
}

// Sets the throughput of all recorded vertices but those on rims to zero.
EG_INLINE void keep_rims(VertexMemory& memory) {
    for (int64_t k = 0; k < memory.count; ++k) {
        Vertex& v = memory.at<W>(k);
        const Mask rim = load(v.rim) != splat(kNoRim);
        for (auto& channel : v.throughput) store(channel, select(rim, load(channel), 0.0f));
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
