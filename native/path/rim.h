// Paths of the picture that are scattered once along the rim of a transmission lobe
// (shading/bsdf/transmission_rim.h), for what moves as rims move.
//
// They are recorded like those of the interior term, with `VertexMemory::rims`: at each surface whose lobe
// has a rim a path goes along it by chance, surely where it is scattered for the last time, and as any other
// path before and after. Sweeps (adjoint/vertex.h) then have of that vertex f |cos| g, whose value is 0 and
// whose derivative is that of the rim, in the place of f |cos|; other vertices count for nothing but the
// light that they send there. So all that moves a rim is on the same tape as all that changes shading.
//
// Light of surfaces and of the environment is what the ray along the rim finds, with any density of its own:
// no emitter sample is on a rim. Sized lights of the light table, which recorded rays don't meet, are
// looked for along it.
#pragma once

#include "path/scatter.h"
#include "path/shaded_surface.h"
#include "tasks/image_task.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// With what probability paths that may be scattered again leave along the rim.
constexpr float kRimChance = 0.5f;
// The density of such rays: beside it that of other strategies is nothing (power_heuristic).
constexpr float kRimDensity = 1e18f;

// One of the sized lights of the table that are met along w, all equally likely (reservoir sampling), as an
// emitter sample that counts `count` times.
EG_OUTLINE LightSample light_on_rim(const SceneView& scene, const PathPacket& p, const SurfacePoint& x,
                                    Vec3 w, Float u, Float& count) {
    const LightView& lights = scene.lights;
    LightSample s = no_light_sample(splat(0), splat(0), splat(-1), splat(0));
    s.w = w;
    s.r = count = splat(0.0f);
    s.distant = splat(0);
    const auto meet = [&](int row, Mask seen, const LightRow& l, Float) EG_INLINE_LAMBDA {
        count = count + select(seen, splat(1.0f), 0.0f);
        const Float share = 1.0f / max(count, 1.0f);
        const Mask taken = seen & (u < share);
        u = select(seen, select(taken, u * count, (u - share) / max(1.0f - share, 1e-6f)), u);
        const int kind = lights.kind[lights.light_of_row[row]];
        Float unused;
        s.row = select(taken, splat(row), s.row);
        s.kind = select(taken, splat(kind), s.kind);
        s.r = select(taken, meet_light(l, kind, x.position, w, unused), s.r);
        s.distant = select(taken, splat(kind >= kDirectionLight ? -1 : 0), s.distant);
    };
    for_each_met_light(scene, p.active, x.position, x.mesh, w, splat(0.0f), splat(__builtin_inff()),
                       splat(static_cast<int>(kTransmissionRay)), meet);
    s.active = s.row >= 0;
    if (any(s.active)) {
        const Int row = select(s.active, s.row, splat(0));
        take_links(lights, s.active, row, gather_light(lights, row).flags, s);
    }
    s.end = x.position + w * select(s.distant, splat(1.0f), s.r);
    return s;
}

// Lanes of paths that look for a rim and are scattered along one here.
struct RimChoice {
    Mask taken;
    Float others;  // the weight of those that go on otherwise
    Float u;       // what is left of the number by which they were picked
    Float chance;  // by which they were
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
    // Before rims emitter samples have no use for these.
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

// Sends the paths of a choice along their rims; the queue's new length. Lobes that are followed have a rim
// for lights of the table alone: what else their rays show moves with them.
EG_OUTLINE int scatter_at_rim(const SceneView& scene, const ImageTask& task, Workspace& work, PathPacket p,
                              const SurfacePoint& x, const ShadedSurface& surface, const RimChoice& r,
                              Mask followed, int alive, Vertex& vertex) {
    const Vec3 w = to_world(surface.bsdf, r.sample.w);
    p.active &= r.taken & r.sample.active & (dot(x.normal, w) < 0.0f);
    const Vec3 f = rim_value(surface.bsdf.glass, surface.bsdf.view, r.sample.w);
    p.active &= largest_component(f) > 0.0f;
    if (!any(p.active)) return alive;
    const Float scale = 1.0f / (r.sample.pdf * max(r.chance, kRimChance));
    put(vertex.rim, p.active, splat(-1));
    if (scene.lights.sized_count + scene.lights.sized_distant > 0) {
        Float count;
        const LightSample s = light_on_rim(scene, p, x, w, r.u, count);
        if (any(s.active)) {
            Vec3 light = gray(select(s.active, scale * count, 0.0f));
            const Vec3 start = leave_surface(x, w) + terminator_lift(scene, x, surface.normal, w);
            const Vec3 through =
                transmittance(scene, s.active & s.casts_shadow, start, select(s.distant, w, s.end - start),
                              select(s.distant, splat(__builtin_inff()), 0.99999f),
                              shadow_rays(work, &vertex, kRayToLight, s.blockers));
            light = select(s.casts_shadow, light * through, light);
            record_light(vertex, s, light);
        }
    }
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
    leave(p, x, w, kind, splat(kRimDensity));
    return append_paths(work.paths, alive, p);
}

// Of recorded paths, vertices but those on rims count for nothing by themselves.
EG_INLINE void keep_rims(VertexMemory& memory) {
    for (int64_t k = 0; k < memory.count; ++k) {
        Vertex& v = memory.at<W>(k);
        const Mask rim = load(v.rim);
        for (auto& channel : v.throughput) store(channel, select(rim, load(channel), 0.0f));
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
