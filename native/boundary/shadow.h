// Shadow boundary term: what changes where an edge passes between a lit surface and its light.
//
// Formula (S) of the derivations, sampled from the edge outwards. With e(u) a point of an edge of
// direction t = b - a, w the direction of light from y through e to the first surface behind it, x:
//   dI = int du int dw  J f_r L(y) sigma (t x w) . (de - lambda dx - (1 - lambda) dy),
// f_r the BSDF of x towards the camera (times |n_s . w|/|n . w| where its shading normal is another),
// J = f^2 |n . p|/z^3 the screen's area per area at x, lambda = |e - y|/|x - y|.
// sigma is the side of the edge's faces: where they are on both sides, light doesn't pass there.
//   triangle:    L dw = L_e |w . M_y|/(2 |e - y|^2 P)      (what EmitterSample::geometry holds)
//   point light: L dw = I/|e - y|^2,   sun: its irradiance and lambda = 1
//   environment: w about the edge, its cosine to t uniform, its azimuth uniform in the two wedges in
//                which both faces are on one side, each of width alpha: density 1/(4 alpha); lambda = 1.
// x slides along its pixel's ray, y rides on its triangle.
#pragma once

#include "boundary/camera_connection.h"
#include "boundary/segment.h"
#include "boundary/silhouette.h"
#include "shading/emitters.h"

namespace edgegrad::EDGEGRAD_ISA {

template <typename Wanted>
EG_INLINE BoundarySegment sample_shadow(const SceneView& scene, const BoundaryTask& task, int64_t at,
                                        PieceCursor& piece, const DerivativeView& asked,
                                        const Wanted& wanted) {
    BoundarySegment s;
    PieceSample p = sample_piece(scene, task, at, piece);
    s.edge = p.edge;
    s.instance = p.instance;
    s.u = p.u0 + (p.u1 - p.u0) * p.tau;
    s.point = p.a + p.t * s.u;
    s.y = still_far_end();
    s.view.sx = s.view.sy = splat(0.0f);
    Vec3 light, towards;
    Float lambda_distance;
    EmitterSample emitter;
    if (task.kind == kSkyBoundary) {
        Float u, v, density;
        sobol_pair(p.random.stream, p.random.sample, kPairEnvironment, u, v);
        const Vec3 w = wedge_direction(scene, p, u, v, density);  // travels along w
        towards = -w;
        light = splat3(scene.environment) * (1.0f / density);
        lambda_distance = splat(__builtin_inff());
    } else {
        Float u, v;
        sobol_pair(p.random.stream, p.random.sample, kPairLight, u, v);
        emitter = sample_emitter(scene, p.active, s.point, u, v);
        p.active &= emitter.active;
        towards = emitter.w;
        light = emitter.radiance * emitter.geometry;
        lambda_distance = emitter.r;
        const Mask on_triangle = emitter.kind == kEmissiveTriangle;
        s.y.face = select(on_triangle, emitter.index, splat(-1));
        s.y.b1 = emitter.b1;
        s.y.b2 = emitter.b2;
    }
    const Vec3 across = cross(p.t, -towards);
    const Float sigma = occluder_side(scene, p, across);
    s.sweep = across * sigma;
    s.active = p.active & (sigma != 0.0f);
    if (!any(s.active)) return s;

    // The surface that is lit past the edge.
    const Ignored ignored = {s.edge, s.instance};
    const Closest behind = intersect(scene, s.active, s.point, -towards, splat(0.0f), splat(__builtin_inff()),
                                     ignored, embree::kIncoherent);
    const Float scale = largest_component(s.point);
    // Nearer than rounding the jump is the primary boundary's (derivations F3c).
    s.active &= behind.hit & (behind.distance > 1e-5f * scale);
    const Vec3 position = interpolate(gather_triangle(scene, behind.face), behind.b1, behind.b2);
    s.view = place_in_picture(scene, s.active, position, p.random);
    s.x = surface_point(scene, s.view.active, behind.face, behind.b1, behind.b2, s.view.direction,
                        behind.instance);
    s.active = s.x.active & (dot(s.x.normal, towards) > 0.0f);
    s.slides = s.active;
    s.active &= segment_moves(scene, asked, s);
    if (any(s.active)) s.active &= wanted(s);
    if (!any(s.active)) return s;

    // Light reaches the edge, and the camera sees x.
    if (task.kind == kSkyBoundary) {
        s.active &= ~occluded(scene, s.active, s.point, towards, splat(__builtin_inff()), ignored);
    } else {
        emitter.active = s.active;
        s.active &= ~emitter_hidden(scene, s.point, s.point, ignored, emitter);
    }
    s.x.active = s.active;
    const Vec3 seen = seen_by_camera(scene, s.active, s.x, s.view, task.limits.transparent);
    s.active &= largest_component(seen) > 0.0f;
    if (!any(s.active)) return s;
    s.lambda = select(lambda_distance < __builtin_inff(),
                      lambda_distance / (lambda_distance + behind.distance), splat(1.0f));
    Float choice = splat(0.5f), unused;
    if (scene.any_mixture) sobol_pair(p.random.stream, p.random.sample, kPairStrategy, choice, unused);
    s.x.active = s.active;
    const Int camera_ray = splat(static_cast<int>(kCameraRay));
    s.color =
        scattered_towards(scene, s.x, -s.view.direction, towards, camera_ray, splat(kScatteredRays), choice) *
        light * seen * (s.view.area / p.density);
    s.active = keep_finite(task, at, s.active, s.edge, s.instance, size_of(s));
    return s;
}

static void shadow_forward_kernel(const SceneView& scene, const BoundaryTask& task, Workspace&,
                                  const DerivativeView& tangent, Splats& splats) {
    PieceCursor piece = first_piece(task);
    for (int64_t at = 0; at < task.count; at += W) {
        const BoundarySegment s =
            sample_shadow(scene, task, at, piece, tangent, [](const BoundarySegment&) { return splat(-1); });
        Forward mode{scene, tangent};
        if (any(s.active)) segment_blocks(mode, scene, tangent, s);
        write_splats(task, splats, at, s.active, s.view.sx, s.view.sy, mode.value);
    }
}

static void shadow_backward_kernel(const SceneView& scene, const BoundaryTask& task, Workspace&,
                                   const float* adjoint, DerivativeView& gradient) {
    const auto adjoint_of = [&](const BoundarySegment& s) EG_INLINE_LAMBDA {
        return adjoint_at(scene.camera, s.active, s.view.sx, s.view.sy, adjoint);
    };
    PieceCursor piece = first_piece(task);
    for (int64_t at = 0; at < task.count; at += W) {
        const BoundarySegment s = sample_shadow(
            scene, task, at, piece, gradient,
            [&](const BoundarySegment& found) { return largest_component(adjoint_of(found)) > 0.0f; });
        if (!any(s.active)) continue;
        Backward mode{scene, gradient, adjoint_of(s)};
        segment_blocks(mode, scene, gradient, s);
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
