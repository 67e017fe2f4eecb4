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
#include "shading/emitters.h"

namespace edgegrad::EDGEGRAD_ISA {

// Unit vectors across the edge into its first face (b1) and at a right angle to it towards the second
// (b2), and the angle delta between the two faces (0 unless there are exactly two).
EG_INLINE void edge_frame(const SceneView& scene, const PieceSample& p, Vec3& axis, Vec3& b1, Vec3& b2,
                          Float& delta) {
    axis = p.t * (1.0f / max(sqrt(dot(p.t, p.t)), 1e-30f));
    Vec3 third[2] = {zero3(), zero3()};
    Mask two = splat(0);
    for (int i = 0; i < W; ++i) {
        const uint32_t first = scene.edge_face_first[p.edge[i]], last = scene.edge_face_first[p.edge[i] + 1];
        two[i] = last - first == 2 ? -1 : 0;
        for (uint32_t k = 0; k < 2 && first + k < last; ++k) {
            const float* c = scene.vertices + 3 * static_cast<int64_t>(scene.edge_opposite[first + k]);
            third[k].x[i] = c[0] - p.a.x[i], third[k].y[i] = c[1] - p.a.y[i], third[k].z[i] = c[2] - p.a.z[i];
        }
    }
    Vec3 across[2];
    for (int k = 0; k < 2; ++k) {
        const Vec3 g = third[k] - axis * dot(third[k], axis);
        across[k] = g * (1.0f / max(sqrt(dot(g, g)), 1e-30f));
    }
    b1 = across[0];
    b2 = cross(axis, b1);
    const Float c = dot(b1, across[1]), s = dot(b2, across[1]);
    b2 = select(two & (s < 0.0f), -b2, b2);
    // Accurate for small and for nearly flat angles alike.
    for (int i = 0; i < W; ++i) delta[i] = two[i] ? __builtin_atan2f(__builtin_fabsf(s[i]), c[i]) : 0.0f;
}

// sigma: +1 or -1 if all faces of the edge lie on that side of the sheet of normal `across`, else 0.
EG_INLINE Float occluder_side(const SceneView& scene, const PieceSample& p, Vec3 across) {
    Float sigma = splat(0.0f);
    for (int i = 0; i < W; ++i) {
        if (!p.active[i]) continue;
        int plus = 0, minus = 0;
        for (uint32_t k = scene.edge_face_first[p.edge[i]]; k < scene.edge_face_first[p.edge[i] + 1]; ++k) {
            const float* c = scene.vertices + 3 * static_cast<int64_t>(scene.edge_opposite[k]);
            const float h = across.x[i] * (c[0] - p.a.x[i]) + across.y[i] * (c[1] - p.a.y[i]) +
                            across.z[i] * (c[2] - p.a.z[i]);
            plus += h > 0.0f;
            minus += h < 0.0f;
        }
        sigma[i] = plus && !minus ? 1.0f : minus && !plus ? -1.0f : 0.0f;
    }
    return sigma;
}

// Direction to the environment about the edge; the density of its solid angle.
EG_INLINE Vec3 environment_direction(const SceneView& scene, const PieceSample& p, Float& density) {
    Vec3 axis, b1, b2;
    Float delta = splat(0.0f), u, v;
    edge_frame(scene, p, axis, b1, b2, delta);
    sobol_pair(p.random.stream, p.random.sample, kPairEnvironment, u, v);
    constexpr float kPi = 3.14159265f;
    const Float alpha = splat(kPi) - delta;
    const Float cosine = 2.0f * u - 1.0f, sine = sqrt(max(1.0f - cosine * cosine, 0.0f));
    const Mask second = v >= 0.5f;
    const Float within = select(second, 2.0f * v - 1.0f, 2.0f * v);
    Float azimuth = (delta + within * alpha + select(second, splat(kPi), 0.0f)) * (0.5f / kPi);
    azimuth = select(azimuth >= 1.0f, azimuth - 1.0f, azimuth);
    Float s, c;
    sincos_turn(max(azimuth, 0.0f), s, c);
    density = 1.0f / (4.0f * max(alpha, 1e-12f));
    return axis * cosine + (b1 * c + b2 * s) * sine;
}

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
        Float density;
        const Vec3 w = environment_direction(scene, p, density);  // travels along w
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
