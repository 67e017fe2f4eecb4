// Paths that are scattered once along the rim of a transmission lobe (shading/bsdf/transmission_rim.h) or of
// a rough diffuse lobe (shading/bsdf/diffuse_rim.h). They estimate the derivative due to the motion of rims,
// for transmission lobes
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
// explicitly: along the ray, or, on diffuse rims, in the arcs in which they cut the rim's plane.
#pragma once

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
    Mask diffuse;      // the rim of the diffuse lobe
    RimSample sample;  // in world space
};

EG_OUTLINE RimChoice choose_rims(const SceneView& scene, const ImageTask& task, const PathPacket& p,
                                 const ShadedSurface& surface, const PathIndex& index) {
    RimChoice r;
    r.others = splat(1.0f);
    r.u = r.chance = splat(0.0f);
    r.taken = r.diffuse = splat(0);
    r.sample = {splat(0), surface.normal, splat(1.0f)};
    const Bsdf& f = surface.bsdf;
    // The domain of a followed lobe moves with it, but for light that its rays do not meet.
    Mask through = splat(0);
    if (f.any_lobe[kInterfaceLobe])
        through = has_rim(f.glass, f.view) &
                  (~f.glass.facets.followed | (widest_alpha(f.glass.facets) > scene.least_followed));
    const Mask diffuse = has_diffuse_rim(f), may = p.active & ~p.past_rim & (through | diffuse);
    if (!any(may)) return r;
    // Emitter samples do not use these random numbers before the rim.
    const auto [choice, place] = sobol_pair(index, vertex_pair(p.vertex, kVertexLight));
    const Mask last = p.segment + 1 >= task.max_depth;
    r.chance = select(last, splat(1.0f), splat(kRimChance));
    r.taken = may & (choice < r.chance);
    r.u = choice / max(r.chance, kRimChance);
    r.others = select(may & ~r.taken, splat(1.0f / (1.0f - kRimChance)), 1.0f);
    // Choose one of two rims
    const Mask both = through & diffuse;
    r.diffuse = diffuse & (~both | (r.u < 0.5f));
    r.u = select(both, fract(2.0f * r.u), r.u);
    r.chance = select(both, 0.5f * r.chance, r.chance);
    if (any(may & r.diffuse)) r.sample = sample_diffuse_rim(f, place);
    if (any(may & ~r.diffuse)) {
        const RimSample s = sample_rim(f.glass, f.view, place);
        const Vec3 w = to_world(f, s.w);
        r.sample = {select(r.diffuse, r.sample.active, s.active), select(r.diffuse, r.sample.w, w),
                    select(r.diffuse, r.sample.pdf, s.pdf)};
    }
    return r;
}

// Scatters paths along their rims. Returns the queue's new length.
EG_OUTLINE int scatter_at_rim(const SceneView& scene, const ImageTask& task, Workspace& work, PathPacket p,
                              const SurfacePoint& x, const ShadedSurface& surface, const RimChoice& r,
                              int alive, Vertex& vertex) {
    // Evaluate the lobe at its rim
    const Vec3 w = r.sample.w;
    const Bsdf& bsdf = surface.bsdf;
    const auto reaches = [&](Vec3 towards) {
        const Float side = dot(x.normal, towards);
        return select(r.diffuse, side > 0.0f, side < 0.0f);
    };
    const Mask diffuse = p.active & r.taken & r.diffuse;
    p.active &= r.taken & r.sample.active & reaches(w);
    Vec3 f = diffuse_rim_value(bsdf, w);
    if (any(p.active & ~r.diffuse))
        f = select(r.diffuse, f, rim_value(bsdf.glass, bsdf.view, to_local(bsdf, w)));
    f = f * surface.kept_at_rim(w);
    p.active &= largest_component(f) > 0.0f;
    if (!any(p.active | diffuse)) return alive;
    put(vertex.rim, p.active | diffuse, splat(-1));
    const Int kind = select(r.diffuse, splat(kDiffuseRay), splat(kTransmissionRay));
    // Sample the lights of the table along the rim: those that the ray meets, or, on a diffuse rim, the arc
    // in which a light meets its plane
    const Mask through = p.active & ~r.diffuse;
    const Float share = 1.0f / max(r.chance, 0.5f * kRimChance), scale = share / r.sample.pdf;
    Mask followed = splat(0);
    if (bsdf.any_lobe[kInterfaceLobe]) followed = through & bsdf.glass.facets.followed;
    if (scene.lights.all_sized() > 0) {
        Float count;
        LightSample s = sample_met_light(scene, through, x, w, kind, bounces_before(p), r.u, count);
        Float light = scale * count;
        if (any(diffuse)) {
            const LightSample arc = sample_light_arc(scene, diffuse, x.position, surface.normal, x.face, r.u);
            s = select(diffuse, arc, s);
            s.active &= (s.row >= 0) & (~diffuse | (shines_on(scene, s.row, x.mesh, bounces_before(p)) &
                                                    ((s.visible_to & ray_mask(kind)) != 0) & reaches(s.w)));
            light = select(diffuse, share * s.geometry, light);
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
    put(vertex.transmitted, p.active, ~r.diffuse);
    put3(vertex.next_direction, p.active, w);
    put(vertex.next_scale, p.active, scale);
    p.final_ray = next_is_final(task, p, kind);
    p.throughput = p.throughput * f * scale;
    p.lobe = {};
    p.past_rim = splat(-1);
    p.led = splat(0);
    p.both_sides = surface.both_sides() | ~r.diffuse;
    leave(p, x, receiving_normal(scene, x, unbent_normal(surface)), w, kind, splat(kRimDensity));
    return append_paths(work.paths, alive, p);
}

// Sets the throughput of all recorded vertices but those on rims to zero.
EG_INLINE void keep_rims(VertexMemory& memory) {
    for (int64_t k = 0; k < memory.count; ++k) {
        Vertex& v = memory.at<W>(k);
        const Mask rim = load(v.rim);
        for (auto& channel : v.throughput) store(channel, select(rim, load(channel), 0.0f));
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
