// Specular boundary term: the picture of an edge, or of a shadow edge (boundary/specular/chain_shadow.h),
// that is seen through mirrors and smooth glass (derivations, J).
//
// A chain of perfect reflections and refractions ends with a ray from p along D. Both are functions of the
// place s in the picture and of the parameter theta. The ray touches the edge of direction t through e where
//   g(s, theta) = (e - p) . (t x D) = 0.
// This curve moves with the velocity -dg/dtheta / |grad_s g| along its normal n = grad_s g / |grad_s g|, so
// that
//   dI = int dl T (L- - L+) (-dg/dtheta) / |grad_s g|.
// T is the chain's throughput. L+ and L- are the radiance on the sides where g > 0 and g < 0; N = (e - p) x t
// points to the plus side. The integral is sampled by horizontal and vertical scan lines. A curve element dl
// crosses |n_x| dl horizontal lines, if these are one unit apart. With the weights n_x^2 + n_y^2 = 1 for the
// two directions
//   dI = sum over crossings of T (L- - L+) (-dg/dtheta) |g_k| / (g_x^2 + g_y^2),
// where k = x on horizontal and k = y on vertical lines. The factor |g_k| / |grad_s g| is bounded for all
// directions of the curve.
//
// The derivatives of p and D are those of the recorded chain (adjoint/vertex.h). The edge contributes
// N . de/r, r = |e - p|. Outlines of distance fields: boundary/specular/chain_curve.h; of lights of the
// table: boundary/specular/mirrored_outline.h.
#pragma once

#include "boundary/segment/scattering_chain.h"
#include "boundary/specular/chain_shadow.h"
#include "boundary/specular/mirrored_outline.h"
#include "boundary/specular/stored_place.h"
#include "boundary/specular/thrown_edge.h"
#include "path/recorder.h"
#include "tasks/boundary_task.h"
#include "tasks/image_task.h"
#include "tasks/splats.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// Replays the chains of crossings [at, at + W) and records their vertices. Returns the lanes whose replay
// succeeded. Sets `ray` to the last ray, or to the ray that met the last surface if the chain ends at a
// light, and `p` to the path's state. If an edge separates two faces of which only one continues the ray,
// `touching` is set to the ray before the last one, and the vertex in between is not recorded.
EG_OUTLINE Mask record_chains(const SceneView& scene, const BoundaryTask& task, const ChainCrossings& c,
                              int at, int count, VertexMemory& vertices, ChainRay& ray, ChainRay& touching,
                              PathPacket& p) {
    const Mask active = first_lanes(count - at);
    PicturePoint place = {load(c.x + at), load(c.y + at), load(c.lens_u + at), load(c.lens_v + at)};
    place = {select(active, place.x, 0.0f), select(active, place.y, 0.0f), select(active, place.lens_u, 0.5f),
             select(active, place.lens_v, 0.5f)};
    Float near, far;
    ray = touching = chain_start(scene.camera, place, near, far);
    ChainCount counted(task.limits, task.max_depth);
    Mask fine = active;
    // `passed` and `waiting` hold the transmittance and the number of transparent surfaces since the last
    // scattering vertex. They enter the throughput when the chain scatters again. look_behind() handles the
    // transparent surfaces in front of the edge.
    Vec3 throughput = one3(), passed = throughput;
    Int waiting = splat(0);
    Mask aimed = splat(0);        // lanes that have scattered towards a stored vertex
    Float density = splat(0.0f);  // not 0: the ray leaves a surface whose lobes are not perfect
    Vec3 from_normal = ray.direction;
    Int from_mesh = splat(0);
    const Int length = select(active, load(c.length + at), splat(0));
    const Mask horizon = at_horizon(c, at, count), parted = active & load(c.parted + at);
    for (int level = 0; level < kMostChain; ++level) {
        const Mask here = active & (level < length);
        if (!any(here)) break;
        const auto column = [&](int32_t* const(&table)[kMostChain], int rest) {
            return select(here, load(table[level] + at), splat(rest));
        };
        // Shade the stored vertex
        Closest hit;
        hit.hit = here;
        hit.face = column(c.face, 0), hit.mesh = column(c.mesh, 0), hit.instance = column(c.instance, -1);
        hit.b1 = select(here, load(c.b1[level] + at), 0.0f);
        hit.b2 = select(here, load(c.b2[level] + at), 0.0f);
        hit.distance = splat(0.0f);
        const Int event = column(c.event, kEventPasses);
        const auto half_part = [&](int k) { return select(here, load(c.half[k][level] + at), 0.0f); };
        const Vec3 half = {half_part(0), half_part(1), half_part(2)};
        SurfacePoint x = hit_surface(scene, here, hit, ray.direction);
        const TexturePoint point = texture_point(scene, x, -ray.direction, ray.kind);
        const ChainSurface s = chain_surface(scene, x, point, column(c.closure, 0));
        const Mask passes = here & (event == kEventPasses), lit = here & (event == kEventLit);
        const Mask aims = here & (event == kEventAims), scatters = here & ~passes & ~lit & ~aims;
        if (attenuates(scene))
            throughput =
                throughput *
                kept_on_segment(scene, x, s.shader.closure, ray.origin, length_of(x.position - ray.origin),
                                near_plane(scene, level == 0 ? here : splat(0), unit_vector(ray.direction)));

        // Record the ray's arrival
        PathPacket arrived{};
        arrived.active = here;
        arrived.path = lane_index() + at;
        arrived.origin = arrived.from = ray.from;
        arrived.direction = ray.direction;
        arrived.pdf = density;
        arrived.from_mesh = from_mesh;
        arrived.kind = select(here, ray.kind, splat(0)), arrived.lobe = ray.lobe;
        const Mask behind = parted & (length == level + 1), recorded = here & ~behind;
        touching = select(behind, ray, touching);
        arrived.active = recorded;
        Vertex& v = vertices.append<W>();
        record_arrival(scene, v, arrived, recorded, hit);
        put(v.closure, here, s.shader.closure);
        put(v.passes, passes, splat(-1));
        if (any(density > 0.0f)) {
            arrived.from_normal = from_normal;
            arrived.segment = counted.p.segment;
            record_contact(scene, v, arrived, x);
        }

        // Update the throughput and scatter the ray
        const Float kept = s.closure_weight;
        passed = select(passes, passed * s.passing * (s.transparency * kept), passed);
        waiting = waiting - passes;
        throughput = select(lit, throughput * passed * ((1.0f - s.transparency) * kept), throughput);
        density = select(scatters, splat(0.0f), density);
        if (any(aims)) {
            density = select(aims, splat(1.0f), density);
            throughput = select(aims, one3(), throughput);
            passed = select(aims, one3(), passed);
            waiting = waiting & ~aims;
            ray = select(aims, ray_to(scene, x, stored_place(scene, c, at, aims, level + 1)), ray);
            from_normal = select(aims, x.normal, from_normal);
            from_mesh = select(aims, x.mesh, from_mesh);
            counted.add(aims, aimed_kind(scene));
            aimed |= aims;
        }
        if (!any(scatters)) continue;
        Vec3 value;
        Mask below;
        const Mask goes_on = scatter_chain(scene, s, scatters, event, half, ray, value, below);
        // At a horizon rounding decides whether the ray continues.
        fine &= goes_on | ~scatters | (below & horizon & (length == level + 1));
        const Mask thrown = scatters & aimed & ((event & kEventFollows) != 0);
        if (any(thrown)) value = select(thrown, value * share_above(dot(x.normal, ray.direction)), value);
        if (any(aimed)) {
            const Mask next = scatters & aimed & (length > level + 1);
            if (any(next)) fine &= ~next | points_at(ray, stored_place(scene, c, at, next, level + 1));
        }
        // Record the scattering event
        const Mask bends = scatters & recorded;
        put(v.samples, bends, splat(-1));
        put(v.continues, bends, splat(-1));
        put(v.specular, bends, splat(-1));
        put(v.transmitted, bends, (event & kEventTransmits) != 0);
        put(v.lobe, bends, event & kEventLobes);
        const Mask follows = bends & ((event & kEventFollows) != 0);
        put(v.follows, follows, splat(1) << (event & kEventLobes));
        put3(v.half, follows, half);
        put3(v.next_direction, bends, ray.direction);
        throughput =
            select(scatters, throughput * passed * value * ((1.0f - s.transparency) * kept), throughput);
        passed = select(scatters, one3(), passed);
        from_normal = select(scatters, x.normal, from_normal);
        from_mesh = select(scatters, x.mesh, from_mesh);
        counted.add(scatters, ray.kind);
        counted.p.bounces = counted.p.bounces + ((waiting & scatters) << 24);
        counted.p.vertex = counted.p.vertex + ((waiting + 1) & scatters);
        waiting = waiting & ~scatters;
    }
    touching = select(parted, touching, ray);
    const Mask past_edge = aimed & (load(c.edge + at) >= 0);
    if (any(past_edge)) fine &= ~past_edge | points_at(ray, stored_edge_point(scene, c, at, past_edge));
    p = counted.p;
    p.throughput = throughput;
    p.from_normal = p.from_receiving = from_normal;
    p.from_mesh = from_mesh;
    p.kind = select(active, ray.kind, splat(0)), p.lobe = ray.lobe;
    return fine;
}

EG_INLINE Vec3 load_jump(const ChainCrossings& c, int at) {
    Vec3 jump;
    load3(jump, c.jump, at);
    return jump;
}
EG_INLINE void store_jump(ChainCrossings& c, int at, Mask m, Vec3 jump) {
    store3(c.jump, at, select(m, jump, zero3()));
}

// The surfaces at which the chains of lit crossings end, where `ray` has met them.
EG_INLINE ChainSurface receiver(const SceneView& scene, const ChainCrossings& c, int at, Mask lit,
                                const ChainRay& ray) {
    const LastVertex v = last_vertex(c, at, lit);
    SurfacePoint x = surface_point(scene, lit, v.face, v.b1, v.b2, ray.direction, v.instance);
    x.mesh = v.mesh;
    return chain_surface(scene, x, texture_point(scene, x, -ray.direction, ray.kind), v.closure);
}

// Appends to the queue the paths that estimate the radiance from the far surfaces of crossings [at, at + W)
// past the edges to x. `p` is the path as it arrives at x. Returns the lanes within the bounce limits.
EG_OUTLINE Mask append_surfaces(const SceneView& scene, const BoundaryTask& task, const ChainCrossings& c,
                                int at, Mask active, const EdgeSample& s, const ScatteringPoint& x,
                                const PathPacket& p, Workspace& work, int& queued) {
    const ChainLight light = load_light(c, at, active);
    const ChainLightRay way = see_chain_light(scene, active, light, x.x.position);
    Int bounces = p.bounces & 0xffffff;
    active = scatters_within_limits(
        scene, task, active, x.x, way.w, splat(kScatteredRays), s.random, splat(0),
        [&](Int kinds) EG_INLINE_LAMBDA { return x.evaluate(scene, active, way.w, kinds); }, bounces);
    Closest y;
    y.hit = active;
    y.face = light.face, y.instance = light.instance, y.b1 = light.b1, y.b2 = light.b2;
    y.mesh = mesh_of(scene, select(active, light.face, splat(0)));
    y.distance = way.distance - s.view.distance;
    queued = append_scattering(work, queued, active, lane_index() + at, s.point, way.w, y, zero3(),
                               kept_before_start(scene, active, y, s.point, way.w, s.view.distance), splat(0),
                               p.segment + 1, bounces, splat(kDiffuseRay));
    return active;
}

// Computes the jumps at crossings with shadow edges, and their slopes with respect to the chains' ends.
// Returns the lanes that have a jump.
EG_OUTLINE Mask lit_sides(const SceneView& scene, const BoundaryTask& task, ChainCrossings& c, int at,
                          int count, Mask lit, const ChainRay& ray, const PathPacket& p, Workspace& work,
                          int& queued) {
    const ScatteringPoint end = scattering_point(scene, lit, receiver(scene, c, at, lit, ray));
    const Vec3 x = end.x.position;
    EdgeSample s = chain_curve(scene, c, at, count, x, x);
    s.random = path_index(side_paths(task), lane_index() + at);
    s.active &= lit;
    Vec3 jump = zero3(), by_x = zero3();
    Mask seen = shadow_jump(scene, c, at, s, end, jump, by_x);
    const Mask surfaces = seen & load(c.light_scatters + at);
    if (any(surfaces))
        seen &= ~surfaces | append_surfaces(scene, task, c, at, surfaces, s, end, p, work, queued);
    jump = jump * p.throughput * load(c.weight + at);
    put3(c.by_point, at, lit, select(seen, by_x, zero3())), put3(c.by_direction, at, lit, zero3());
    put3(c.jump, at, lit, select(seen, jump, zero3())), put3(c.from, at, lit, x);
    return seen;
}

// Records the chains of `count` crossings and estimates the jumps of radiance across their edges.
static void chain_sides_kernel(const SceneView& scene, const BoundaryTask& task, Workspace& work,
                               VertexMemory& vertices, ChainCrossings& c, int count) {
    vertices.clear();
    const ImageTask paths = side_paths(task);
    int queued = 0;
    for (int at = 0; at < count; at += W) {
        ChainRay onwards, ray;
        PathPacket p;
        const Mask fine = record_chains(scene, task, c, at, count, vertices, onwards, ray, p);
        // Find the surfaces on both sides of the edge and behind it
        EdgeSample s = chain_curve(scene, c, at, count, ray.from, ray.origin);
        const Mask lit = first_lanes(count - at) & load(c.lit + at);
        const Mask shown = fine & ~lit & at_light_outline(c, at, count);
        s.active &= fine & ~lit;
        const Mask horizon = fine & at_horizon(c, at, count), parted = s.active & load(c.parted + at);
        s.active &= ~parted;
        s.mask = ray_mask(p.kind);
        s.random = path_index(paths, lane_index() + at);
        EdgeSample outlined = s;
        outlined.active &= at_outline(c, at, count);
        EdgeSample crossed = s;
        crossed.active &= at_line(c, at, count);
        s.active &= ~(outlined.active | crossed.active);
        if (any(outlined.active)) queued = see_outline(scene, task, c, at, outlined, p, work, queued);
        if (any(crossed.active)) queued = see_line(scene, task, c, at, crossed, p, work, queued);
        Sides sides = visible_faces(scene, s);
        s.active &= (sides.plus.face >= 0) | (sides.minus.face >= 0);
        Behind behind;
        if (any(s.active)) behind = look_behind(scene, s, sides, task.limits.transparent, EdgeFaces{});
        Mask seen = s.active | parted | outlined.active | crossed.active;
        // -dg/dp = t x D and -dg/dD = -N, with D the direction of the recorded ray. Of outlines -n and -r n.
        const Vec3 n = s.normal, r_n = n * sqrt(dot(s.view.across_of, s.view.across_of));
        store3(c.by_point, at,
               select(outlined.active, -n, select(seen, cross(s.tangent, ray.direction), zero3())));
        store3(c.by_direction, at, select(outlined.active, -r_n, select(seen, -n, zero3())));
        store3(c.from, at, select(seen, ray.from, zero3()));
        // Handle horizons and shadow edges
        if (any(horizon)) horizon_slopes(scene, c, at, horizon, ray, p);
        if (any(horizon | parted)) {
            const Mask plus = horizon | is_plus_side(scene, c, at, parted, s);
            const Int path = lane_index() + at + select(plus, splat(0), splat(count));
            queued = see_onwards(scene, horizon | parted, onwards, p, path, work, queued);
        }
        seen |= horizon;
        if (any(shown)) seen |= light_outline_jump(scene, task, c, at, shown, onwards, p);
        if (any(lit & fine)) seen |= lit_sides(scene, task, c, at, count, lit & fine, ray, p, work, queued);
        const Mask thrown = s.active & is_thrown(c, at, count);
        if (any(thrown)) {
            const Vec3 jump = jump_of_thrown(scene, s, sides, behind, ray, p) * p.throughput;
            put3(c.jump, at, thrown, jump * load(c.weight + at));
            s.active &= ~thrown;
        }
        store(c.seen + at, seen);
        if (!any(s.active)) continue;
        // Start a path on each side
        const Float slope = any(behind.touched) ? touched_slope(scene, s, behind.hit) : splat(0.0f);
        const auto start = [&](const SideFace& near, Int number, Vec3 outwards,
                               Float slope_behind) EG_INLINE_LAMBDA {
            const Int mesh = mesh_of(scene, select(near.face >= 0, near.face, splat(0)));
            Vec3 aside;
            const Closest hit = side_hit(scene, s, sides, near, mesh, behind, outwards, slope_behind, aside);
            p.active = s.active;
            p.path = number;
            p.origin = p.from = s.view.origin;
            p.direction = s.view.direction;
            PathPacket side = p;
            side.throughput = p.throughput * behind.through;
            side.vertex = p.vertex + behind.passed;
            side.bounces = p.bounces + (behind.passed << 24);
            queued = append_met(work, queued, side, hit, aside);
        };
        start(sides.plus, lane_index() + at, s.normal, slope);
        start(sides.minus, lane_index() + at + count, -s.normal, -slope);
    }
    // Trace the paths and subtract the two sides
    run_appended(scene, paths, work, queued, 2 * count);
    for (int at = 0; at < count; at += W) {
        Vec3 plus, minus;
        load3(plus, work.radiance, at);
        load3(minus, work.radiance, count + at);
        const Mask lit = load(c.lit + at),
                   known = lit | at_light_outline(c, at, count) | is_thrown(c, at, count);
        const Vec3 towards_x = select(lit & load(c.light_scatters + at), plus, one3());
        store_jump(c, at, load(c.seen + at),
                   select(known, load_jump(c, at) * towards_x, (minus - plus) * load(c.weight + at)));
    }
}

// Multiplies the jumps by the swept length per unit of -dg/dtheta and scan line: |g_k| / (g_x^2 + g_y^2).
static void chain_sweeps_kernel(const BoundaryTask& task, ChainCrossings& c, int count) {
    for (int at = 0; at < count; at += W) {
        const Float gx = load(c.by_screen[0] + at), gy = load(c.by_screen[1] + at);
        const Float across = select(load(c.horizontal + at) != 0, abs(gx), abs(gy));
        const Vec3 jump = load_jump(c, at) * (across / max(gx * gx + gy * gy, 1e-37f));
        const Mask seen = first_lanes(count - at) & load(c.seen + at);
        store_jump(c, at,
                   keep_finite(task, at, seen, load(c.edge + at), load(c.edge_instance + at), size_of(jump)),
                   jump);
    }
}

// Computes the splats of crossings. work.radiance[0] holds the part of -dg/dtheta that is due to the chain.
static void chain_forward_kernel(const SceneView& scene, const ChainCrossings& c, int count, Workspace& work,
                                 const DerivativeView& tangent, Splats& splats) {
    for (int at = 0; at < count; at += W) {
        Vec3 from;
        load3(from, c.from, at);
        EdgeSample s = chain_curve(scene, c, at, count, from, from);
        const Vec3 jump = load_jump(c, at);
        const Mask jumps = largest_component(jump) > 0.0f, horizon = jumps & at_horizon(c, at, count);
        const Mask light = jumps & at_light_outline(c, at, count);
        s.active &= jumps;
        if (!any(s.active | horizon | light)) continue;
        Forward mode{scene, tangent};
        const Vec3 unit = {splat(1.0f), splat(0.0f), splat(0.0f)};
        chain_horizon_blocks(mode, scene, tangent, c, at, horizon, unit);
        light_outline_blocks(mode, scene, tangent, c, at, light, from, unit);
        light_blocks(mode, scene, tangent, c, at, s, from, unit);
        curve_blocks(mode, scene, tangent, c, at, s, unit);
        const Float g = load(work.radiance[0] + at) + mode.value.x;
        const Vec3 value = jump * g;
        for (int i = 0; i < W; ++i) {
            if (!s.active[i] && !horizon[i] && !light[i]) continue;
            const int n = at + i;
            splats.x[n] = c.x[at + i], splats.y[n] = c.y[at + i];
            splats.value[0][n] = value.x[i], splats.value[1][n] = value.y[i], splats.value[2][n] = value.z[i];
        }
    }
}

// Adds the edges' part to the gradient. Writes the adjoints of the chains' part of -dg/dtheta to `seeds`.
static void chain_backward_kernel(const SceneView& scene, const ChainCrossings& c, int count,
                                  const float* adjoint, DerivativeView& gradient, float* seeds) {
    for (int at = 0; at < count; at += W) {
        Vec3 from;
        load3(from, c.from, at);
        EdgeSample s = chain_curve(scene, c, at, count, from, from);
        const Vec3 jump = load_jump(c, at);
        Mask jumps = largest_component(jump) > 0.0f;
        const Mask light = at_light_outline(c, at, count);
        jumps &= s.active | at_horizon(c, at, count) | light;
        const Vec3 a = any(jumps) ? adjoint_at(scene.camera, jumps, select(jumps, load(c.x + at), 0.0f),
                                               select(jumps, load(c.y + at), 0.0f), adjoint)
                                  : zero3();
        const Float seed = select(jumps, dot(a, jump), 0.0f);
        store(seeds + at, seed);
        jumps &= seed != 0.0f;
        s.active &= jumps;
        if (!any(jumps)) continue;
        Backward mode{scene, gradient, a};
        chain_horizon_blocks(mode, scene, gradient, c, at, jumps & at_horizon(c, at, count), jump);
        light_outline_blocks(mode, scene, gradient, c, at, jumps & light, from, jump);
        curve_blocks(mode, scene, gradient, c, at, s, jump);
        light_blocks(mode, scene, gradient, c, at, s, from, jump);
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
