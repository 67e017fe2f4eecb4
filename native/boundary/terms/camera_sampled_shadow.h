// Shadow boundary term, camera-sampled: shadows of the environment that the camera sees, and shadows that it
// sees in sharp lobes.
//
// This estimates the same integral as boundary/terms/shadow.h, for the environment, for emissive meshes and
// for lights of the table with a size, over camera paths of the picture and, from their k-th vertex x, over
// points e of edges (derivations, C1 and I). With r = |x - e|, w the direction from x to e, and beta the
// path's throughput
//   dI = int ds beta sum over edges int du  f |n_s . w|/r^2 L(w)
//        sigma (t x w) . (de - lambda dx - (1 - lambda) dy),
// where y is the light along w. There are two kinds of paths:
// x is the camera's first vertex and y the environment or an emissive mesh: samples that start at edges
// estimate them, too, and both have weights (boundary/segment/shadow_balance.h). Or x is a later vertex: as
// in boundary/terms/camera_sampled.h, the first one scatters by its camera-sampled lobes alone, and all other
// lobes belong to samples that start at edges. Lights without size belong to samples that start at edges. So
// do lights of the table at the first vertex: samples of a light know where its shadows fall, and directions
// of a lobe rarely meet a small light. Emissive meshes take part in scenes with sharp lobes
// (BoundaryTask::shares_faces).
//
// Edges are chosen near a direction to the light, or near one of x's lobes. Candidates behind which there is
// no light have no weight.
#pragma once

#include "boundary/segment/shadow_balance.h"
#include "boundary/segment/shadow_connection.h"
#include "boundary/terms/camera_sampled.h"
#include "shading/lights/environment_samples.h"
#include "shading/lights/lights.h"
#include "shading/lights/met_light.h"

namespace edgegrad::EDGEGRAD_ISA {

// The light whose shadow a sample estimates.
struct ShadowSource {
    Mask environment, table, faces;
    Int kinds;     // of scattering at x
    Int ray_kind;  // to which lights of the table are visible
    Float scale;   // inverse of the probability of these choices
    Float which;   // a random number
};

// Chooses one of the environment, emissive faces and, but for lanes whose x is the camera's first vertex
// (`direct`), the table and, if some lights are hidden from some kinds of rays, one kind.
EG_INLINE ShadowSource choose_source(const SceneView& scene, const BoundaryTask& task, const SegmentSample& p,
                                     Mask direct) {
    const Float pick = sobol_pair(p.random, kPairStrategy).u;
    const auto [which, kind] = sobol_pair(p.random, vertex_pair(splat(kLobeVertex + 7), kVertexChoice));
    const bool sized = scene.lights.all_sized() > 0;
    const Float table = select(~direct & splat(sized ? -1 : 0), splat(1.0f), 0.0f);
    const Float others = table + (scene.has_environment ? 1.0f : 0.0f);
    ShadowSource source;
    source.scale = others + (task.shares_faces ? 1.0f : 0.0f);
    const Float mark = pick * source.scale;
    source.table = mark < table;
    source.environment = ~source.table & (mark < others);
    source.faces = mark >= others;
    source.kinds =
        select(source.table, splat(kScatteredRays | kOfTable),
               select(source.faces, splat(kScatteredRays), splat(kScatteredRays & scene.environment_mask)));
    source.ray_kind = splat(kDiffuseRay);
    source.which = which;
    if (scene.lights.any_hidden && any(source.table)) {
        const Int chosen = select(kind < 1.0f / 3.0f, splat(kDiffuseRay),
                                  select(kind < 2.0f / 3.0f, splat(kGlossyRay), splat(kTransmissionRay)));
        source.ray_kind = select(source.table, chosen, source.ray_kind);
        source.kinds = select(source.table, ray_mask(chosen) | kOfTable, source.kinds);
        source.scale = select(source.table, source.scale * 3.0f, source.scale);
    }
    return source;
}

// A direction near which edges are chosen: half of the time one to the light, if it is sampled, else one of
// x's lobes.
EG_INLINE LobeDirection shadow_direction(const SceneView& scene, const ScatteringPoint& x,
                                         const CameraSampledSurface& surface, Mask active,
                                         const ShadowSource& source, Int bounces, const PathIndex& walk,
                                         Int vertex, const PathIndex& random) {
    const auto [pick, lobe] = sobol_pair(walk, vertex_pair(vertex, kVertexChoice));
    const auto [u, v] = sobol_pair(random, kPairLight);
    LobeDirection around = sample_lobe_direction(surface, active, source.kinds, lobe, random);
    const Mask to_light = active & (pick < 0.5f);
    const auto take = [&](Mask m, Vec3 w, Float pdf) {
        m &= pdf > 0.0f;
        around.towards = select(m, w, around.towards);
        around.width2 = select(m, width2_of(pdf), around.width2);
    };
    if (any(to_light & source.table)) {
        const LightSample s = sample_light(scene, to_light & source.table, x.x, x.both_sides, bounces, u, v);
        take(to_light & source.table & s.active, s.w, s.pdf);
    }
    if (scene.environment_image.sampled && any(to_light & source.environment)) {
        const EnvironmentSample s = sample_environment(scene, to_light & source.environment, u, v);
        take(to_light & source.environment, s.w, s.pdf);
    }
    return around;
}

// Finds the emissive face behind the edge, the radiance that it emits towards the edge, and what passes the
// transparent surfaces before it. Other lanes are dropped.
EG_OUTLINE void meet_face(const SceneView& scene, const BoundaryTask& task, const SegmentSample& p,
                          Mask on_face, Int path, BoundarySegment& s, Vec3& light, Vec3& passed) {
    const LightSource y = find_source(scene, task, s, on_face, path, p.t, -s.towards);
    const Int face = select(y.hit.hit, y.hit.face, splat(0));
    const Mask met = on_face & y.hit.hit & (gather(scene.lights.face_light, face) >= 0);
    s.active &= ~on_face | met;
    s.y.face = select(met, face, s.y.face), s.y.instance = select(met, y.hit.instance, s.y.instance);
    s.y.b1 = select(met, y.hit.b1, s.y.b1), s.y.b2 = select(met, y.hit.b2, s.y.b2);
    s.distance = select(met, y.distance, s.distance);
    const SurfacePoint end = hit_surface(scene, met, y.hit, s.towards);
    const TexturePoint point = texture_point(scene, end, -s.towards, splat(kNoRay), {splat(-1), y.distance});
    light = select(met, emitted_radiance(scene, end, point), light);
    passed = select(met, y.through, passed);
}

// The part of the light from s.towards that x throws (path/lights/thrown_light.h).
EG_OUTLINE Vec3 thrown_share(const SceneView& scene, const ScatteringPoint& x,
                             const CameraSampledSurface& surface, Mask lit, Int kinds,
                             const BoundarySegment& s) {
    const Followed thrown = thrown_of(scene, s.y.row, s.y.face, followed_for(scene, lit, s.y.row));
    const CameraSampledSurface unthrown(scene, x, lit, thrown.reflections());
    const Vec3 all = surface.evaluate(lit, s.towards, kinds), rest = unthrown.evaluate(lit, s.towards, kinds);
    const Float share = share_above(dot(x.x.normal, s.towards));
    const auto part = [&](Float a, Float b) EG_INLINE_LAMBDA {
        return select(lit & (a > 0.0f), share * (1.0f - b / max(a, 1e-30f)), splat(0.0f));
    };
    return {part(all.x, rest.x), part(all.y, rest.y), part(all.z, rest.z)};
}

// A sample of the term (boundary/samples/direct_samples.h).
EG_OUTLINE BoundarySegment sample_shadow_from_camera(const SceneView& scene, const BoundaryTask& task,
                                                     int64_t at, SegmentCursor& cursor,
                                                     const DerivativeView& requested, const float* adjoint) {
    BoundarySegment s;
    // Follow a path of the picture to x
    PicturePath begun = start_in_picture(scene, task, at, cursor, task.max_depth - 2, s);
    SegmentSample& p = begun.segment;
    PathPacket& path = begun.path;
    const ImageTask walks = sample_paths(task, 1, hash(task.seed ^ 0x5bd1e995u));
    if (!scene.has_environment && !task.shares_faces) path.active &= ~s.screen_form;
    const ShadowSource source = choose_source(scene, task, p, s.screen_form);
    WalkParts parts;
    walk_by_sharp_lobes(scene, task, walks, source.table | source.faces, begun, s, parts);
    if (!any(path.active)) return s;
    const ScatteringPoint x = scattering_point(scene, walks, path, path.active, begun.hit);
    s.active = x.x.active & ((source.kinds & kScatteredRays) != 0);
    s.view = place_in_picture(scene, s.active, select(s.screen_form, x.x.position, begun.first), p.random);
    s.active &= s.view.active;
    if (!task.score && any(s.active)) s.active &= has_adjoint(scene, s.active, s.view.sx, s.view.sy, adjoint);
    if (!any(s.active)) return s;

    // Sample an edge in front of the light. Scan lines have the followed lobes of the first vertex.
    const CameraSampledSurface surface(scene, x, s.active, followed_in_picture(scene, s));
    const PathIndex walk = path_index(walks, path.path);
    const LobeDirection around =
        shadow_direction(scene, x, surface, s.active, source, begun.length, walk, path.vertex, p.random);
    const Float rounding = 1e-6f * largest_component(x.x.position);
    const auto meets_light = [&](Mask m, Vec3 w, Float r) EG_INLINE_LAMBDA {
        // Whether an edge in the plane of x hides anything would be up to rounding
        const Mask raised = abs(dot(x.x.normal, w)) * r > 1e-5f * r + rounding;
        Mask lit = m & ~source.table & raised;
        for_each_met_light(scene, m & source.table, x.x.position, x.x.mesh, w, r, splat(__builtin_inff()),
                           source.ray_kind, begun.length,
                           [&](int, Mask seen, const LightRow&, Float, Float)
                               EG_INLINE_LAMBDA { lit |= seen; });
        return lit;
    };
    const Vec3 value = sample_edge_near(scene, task, x, surface, source.kinds, around,
                                        kCameraSampledCandidates, meets_light, p, s);
    if (!any(s.active)) return s;

    const HidingEdge edge = hide_behind(scene, p, x.x, s);
    if (!any(s.active)) return s;

    // Set the light beyond the edge
    Int blockers = environment_blockers(scene);
    Vec3 light = select(source.environment, environment_radiance(scene, s.towards), zero3());
    Vec3 end = s.towards;
    Float far = splat(__builtin_inff());
    s.distance = splat(__builtin_inff());
    s.y.environment = source.environment & turns_with_environment(scene);
    const Mask on_row = s.active & source.table;
    if (any(on_row)) {
        Float count;
        const LightSample met = sample_met_light(scene, on_row, x.x, s.towards, source.ray_kind, begun.length,
                                                 source.which, count);
        const LightRow l = gather_light(scene.lights, select(met.active, met.row, splat(0)));
        const Mask near = on_row & ~met.distant;
        s.active &= ~on_row | (met.active & met.casts_shadow & (met.distant | (met.r > s.reach)));
        s.y.row = select(on_row, met.row, s.y.row), s.y.kind = select(on_row, met.kind, s.y.kind);
        s.distance = select(near, met.r - s.reach, s.distance);
        meet_round_light(scene, s);
        light = select(on_row, l.radiance * (light_factor(l, s.towards, met.r) * count), light);
        blockers = select(on_row, met.blockers, blockers);
        end = select(near, s.towards * s.distance, end);
        far = select(near, splat(0.99999f), far);
    }
    Vec3 passed = one3();
    const Mask on_face = s.active & source.faces;
    if (any(on_face)) meet_face(scene, task, p, on_face, path.path, s, light, passed);
    const Int face = s.y.face;
    if (scene.rays_differ || scene.lights.any_linked) s.active &= is_met(scene, s.edge, blockers);
    divide_segment(s);
    if (any(on_face)) {
        fix_light_direction(scene, s);
        blend_near_contact(scene, begun.length, s);
    }
    s.active &= segment_moves(scene, requested, s);
    if (!any(s.active)) return s;

    // Evaluate the transmittance on both sides of the edge
    PassingRays rays{blockers};
    rays.ignored = {s.edge, s.instance};
    const Vec3 start = leave_surface(x.x, s.towards);
    const Vec3 seen = transmittance(scene, s.active, start, s.point - start, splat(0.99999f), rays) * passed *
                      transmittance(scene, s.active & ~on_face, s.point, end, far, rays);
    Vec3 throughput = path.throughput;
    if (const Mask later = s.active & ~on_face & ~s.screen_form; scene.thrown_alpha > 0.0f && any(later))
        throughput = without_followed(throughput,
                                      parts.rough * thrown_share(scene, x, surface, later, source.kinds, s));
    s.color = throughput * value * seen * light * (x.shader.scale * begun.weight * source.scale);
    const Mask balanced = s.active & s.screen_form;
    if (any(balanced)) {
        Vec3 unused;
        Float scattered = largest_component(surface.evaluate(balanced, s.towards, source.kinds)) *
                          x.shader.scale / max(abs(dot(x.x.normal, s.towards)), 1e-20f);
        if (scene.all_flags & kHasTransparency)
            scattered = scattered * (1.0f - passing_share(x.shader, unused));
        Float density = environment_density(scene, s.towards);
        if (any(on_face))
            density = select(on_face,
                             emitter_density(scene, balanced & on_face, s.point, face, s.towards, s.distance),
                             density);
        const Float edges = share_of_edges(scene, x.x, s.view, s.towards, density, p.t, s.reach, scattered,
                                           task.tree.mass, task.from_camera);
        s.color = select(balanced, s.color * (1.0f - edges), s.color);
    }
    color_of_jump(scene, p, edge, s);
    s.active &= ~(largest_component(s.color) == 0.0f);
    return s;
}

}  // namespace edgegrad::EDGEGRAD_ISA
