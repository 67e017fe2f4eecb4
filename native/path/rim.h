// Paths that are scattered once along the rim of a transmission lobe (shading/bsdf/transmission_rim.h). They
// estimate the derivative due to the motion of rims,
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
// sample lies on a rim. Recorded rays do not meet sized lights of the light table, so the lights along the
// ray are sampled explicitly.
#pragma once

#include "path/scatter.h"
#include "path/shaded_surface.h"
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
    Float others;  // weight of the lanes that are scattered otherwise
    Float u;       // remainder of the random number of the choice
    Float chance;  // probability of the choice
    RimSample sample;
};

EG_OUTLINE RimChoice choose_rims(const ImageTask& task, const PathPacket& p, const ShadedSurface& surface,
                                 const PathIndex& index) {
    RimChoice r;
    r.others = splat(1.0f);
    r.u = r.chance = splat(0.0f);
    r.taken = splat(0);
    if (!surface.bsdf.any_lobe[kInterfaceLobe]) return r;
    const Interface& glass = surface.bsdf.glass;
    const Mask may = p.active & ~p.past_rim & has_rim(glass, surface.bsdf.view);
    if (!any(may)) return r;
    // Emitter samples do not use these random numbers before the rim.
    Float choice, place;
    sobol_pair(index.stream, index.sample, vertex_pair(p.vertex, kVertexLight), choice, place);
    const Mask last = p.segment + 1 >= task.max_depth;
    r.chance = select(last, splat(1.0f), splat(kRimChance));
    r.taken = may & (choice < r.chance);
    r.u = choice / max(r.chance, kRimChance);
    r.others = select(may & ~r.taken, splat(1.0f / (1.0f - kRimChance)), 1.0f);
    r.sample = sample_rim(glass, surface.bsdf.view, place);
    return r;
}

// Scatters paths along their rims. Returns the queue's new length. Followed lobes have rims only for lights
// of the table: the domain of all other light moves with the lobe.
EG_OUTLINE int scatter_at_rim(const SceneView& scene, const ImageTask& task, Workspace& work, PathPacket p,
                              const SurfacePoint& x, const ShadedSurface& surface, const RimChoice& r,
                              Mask followed, int alive, Vertex& vertex) {
    // Evaluate the lobe at its rim
    const Vec3 w = to_world(surface.bsdf, r.sample.w);
    p.active &= r.taken & r.sample.active & (dot(x.normal, w) < 0.0f);
    const Vec3 f = rim_value(surface.bsdf.glass, surface.bsdf.view, r.sample.w);
    p.active &= largest_component(f) > 0.0f;
    if (!any(p.active)) return alive;
    const Float scale = 1.0f / (r.sample.pdf * max(r.chance, kRimChance));
    put(vertex.rim, p.active, splat(-1));
    // Sample the lights of the table along the rim
    if (scene.lights.sized_count + scene.lights.sized_distant > 0) {
        Float count;
        const LightSample s = sample_met_light(
            scene, p.active, x, w, splat(static_cast<int>(kTransmissionRay)), bounces_before(p), r.u, count);
        if (any(s.active)) {
            Vec3 light = gray(select(s.active, scale * count, 0.0f));
            const Vec3 start = leave_surface(x, w) + terminator_lift(scene, x, unbent_normal(surface), w);
            const Vec3 through =
                transmittance(scene, s.active & s.casts_shadow, start, select(s.distant, w, s.end - start),
                              select(s.distant, splat(__builtin_inff()), 0.99999f),
                              shadow_rays(work, &vertex, kRayToLight, s.blockers));
            light = select(s.casts_shadow, light * through, light);
            record_light(vertex, s, light);
        }
    }
    // Continue along the rim and record the direction
    p.active &= ~followed;
    if (!any(p.active)) return alive;
    const Int kind = splat(static_cast<int>(kTransmissionRay));
    put(vertex.samples, p.active, splat(-1));
    put(vertex.continues, p.active, splat(-1));
    put(vertex.transmitted, p.active, splat(-1));
    put3(vertex.next_direction, p.active, w);
    put(vertex.next_scale, p.active, scale);
    p.final_ray = next_is_final(task, p, kind);
    p.throughput = p.throughput * f * scale;
    p.past_rim = splat(-1);
    p.led = p.followed = splat(0);
    p.both_sides = splat(-1);
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
