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

#include "boundary/pieces.h"
#include "path/blocks.h"
#include "path/camera_projection.h"
#include "path/shaded_surface.h"
#include "shading/emitters.h"
#include "shading/lambertian.h"

namespace edgegrad::EDGEGRAD_ISA {

struct ShadowSample {
    Mask active;
    Int edge;
    Float u;
    Vec3 point;    // e
    Vec3 towards;  // unit, from e to the light
    Vec3 sweep;    // sigma (t x w)
    EmitterSample emitter;
    SurfacePoint x;
    Vec3 direction;  // camera to x, of unit depth
    Float lambda;
    Int pixel;
    Vec3 color;            // everything but sweep and velocities, J left out
    Float area_on_screen;  // J / |n . d| = f^2 / z^2
};

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

// Whether the edge's mesh is among the parameters.
EG_INLINE Mask edge_moving(const SceneView& scene, Int edge) {
    Mask moving;
    for (int i = 0; i < W; ++i)
        moving[i] = scene.face_moving[scene.edge_faces[scene.edge_face_first[edge[i]]]] ? -1 : 0;
    return moving;
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

// f |n_s . w| / |n . w| of light along -w that x sends to the camera, for w above the triangle.
EG_OUTLINE Vec3 scattered_to_camera(const SceneView& scene, const SurfacePoint& x, Vec3 direction, Vec3 w,
                                    Float choice) {
    const Vec3 view = -(direction * (1.0f / max(sqrt(dot(direction, direction)), 1e-30f)));
    const TexturePoint point = texture_point(scene, x, view, splat(static_cast<int>(kCameraRay)));
    const Shader shader = surface_shader(scene, x, point, choice);
    Vec3 normal = point.normal;
    if (scene.all_flags & kHasNormalMap)
        normal = shading_normal(scene, x.active & has(shader, kHasNormalMap), shader.leaf, point,
                                shader.color(kNormalMap), shader.row[kNormalStrength]);
    const Mask lambertian = x.active & has(shader, kLambertian), others = x.active & ~lambertian;
    Vec3 value = zero3();
    if (any(lambertian)) {
        const Vec3* smooth = scene.all_flags & kHasNormalMap ? &point.normal : nullptr;
        const Lambertian surface{normal, x.normal, shader.color(kBaseColor), smooth};
        value = select(lambertian, surface.evaluate(lambertian, w).value, value);
    }
    if (any(others))
        value = select(
            others, shaded_surface(scene, others, x, point, shader, normal).evaluate(others, w).value, value);
    const Float above = dot(x.normal, w);
    return select(x.active & (above > 0.0f), value * (shader.scale / max(above, 1e-20f)), zero3());
}

template <typename Wanted>
EG_INLINE ShadowSample sample_shadow(const SceneView& scene, const BoundaryTask& task, int64_t at,
                                     PieceCursor& piece, bool camera_moves, const Wanted& wanted_pixels) {
    ShadowSample s;
    PieceSample p = sample_piece(scene, task, at, piece);
    s.edge = p.edge;
    s.u = p.u0 + (p.u1 - p.u0) * p.tau;
    s.point = p.a + p.t * s.u;
    Vec3 light;
    Float lambda_distance;
    if (task.environment) {
        Float density;
        const Vec3 w = environment_direction(scene, p, density);  // travels along w
        s.towards = -w;
        light = splat3(scene.environment) * (1.0f / density);
        lambda_distance = splat(__builtin_inff());
        s.emitter.active = splat(0);
    } else {
        Float u, v;
        sobol_pair(p.random.stream, p.random.sample, kPairLight, u, v);
        s.emitter = sample_emitter(scene, p.active, s.point, u, v);
        p.active &= s.emitter.active;
        s.towards = s.emitter.w;
        light = s.emitter.radiance * s.emitter.geometry;
        lambda_distance = s.emitter.r;
    }
    const Vec3 across = cross(p.t, -s.towards);
    const Float sigma = occluder_side(scene, p, across);
    s.sweep = across * sigma;
    s.active = p.active & (sigma != 0.0f);
    s.x.active = s.active;
    s.pixel = splat(0);
    if (!any(s.active)) return s;

    // The surface that is lit past the edge.
    const Ignored ignored = {s.edge, splat(-1)};
    const Closest behind = intersect(scene, s.active, s.point, -s.towards, splat(0.0f),
                                     splat(__builtin_inff()), ignored, embree::kIncoherent);
    const Float scale = largest_component(s.point);
    // Nearer than rounding the jump is the primary boundary's (derivations F3c).
    s.active &= behind.hit & (behind.distance > 1e-5f * scale);
    const CameraView& c = scene.camera;
    const Triangle triangle = gather_triangle(scene, behind.face);
    const Vec3 view = interpolate(triangle, behind.b1, behind.b2) - splat3(c.position);
    s.x = surface_point(scene, s.active, behind.face, behind.b1, behind.b2, view);
    const Float depth = -dot(splat3(c.back), view);
    s.direction = view * (1.0f / select(depth > 0.0f, depth, 1.0f));
    s.active =
        s.x.active & (depth > c.clip_start) & (depth < c.clip_end) & (dot(s.x.normal, s.towards) > 0.0f);
    s.pixel = pixel_of(c, s.direction, s.active);

    // What doesn't move sweeps over nothing.
    Mask moves = edge_moving(scene, s.edge) | (gather(scene.face_moving, s.x.face) != 0);
    const Mask on_triangle = s.emitter.active & (s.emitter.kind == kEmissiveTriangle);
    if (!task.environment)
        moves |=
            on_triangle & (gather(scene.face_moving, select(on_triangle, s.emitter.index, splat(0))) != 0);
    if (camera_moves) moves = s.active;
    s.active &= moves & wanted_pixels(s.pixel);
    if (!any(s.active)) return s;

    // Light reaches the edge, and the camera sees x.
    if (task.environment) {
        s.active &= ~occluded(scene, s.active, s.point, s.towards, splat(__builtin_inff()), ignored);
    } else {
        EmitterSample e = s.emitter;
        e.active = s.active;
        s.active &= ~emitter_hidden(scene, s.point, s.point, ignored, e);
    }
    const Vec3 start = leave_surface(s.x);
    const Float to_near_plane = 1.0f - c.clip_start / select(depth > 0.0f, depth, 1.0f);
    s.active &=
        ~occluded(scene, s.active, start, splat3(c.position) - start, to_near_plane, ignore_nothing());

    s.lambda = select(lambda_distance < __builtin_inff(),
                      lambda_distance / (lambda_distance + behind.distance), splat(1.0f));
    if (!any(s.active)) return s;
    Float choice = splat(0.5f), unused;
    if (scene.any_mixture) sobol_pair(p.random.stream, p.random.sample, kPairStrategy, choice, unused);
    SurfacePoint lit = s.x;
    lit.active = s.active;
    s.color = scattered_to_camera(scene, lit, s.direction, s.towards, choice) * light * (1.0f / p.density);
    s.area_on_screen = splat(c.focal * c.focal) / (depth * depth);
    return s;
}

template <typename Mode>
EG_INLINE void shadow_blocks(Mode& mode, const SceneView& scene, const ShadowSample& s,
                             const DerivativeView& asked) {
    const Float nd = dot(s.x.normal, s.direction);  // negative: the normal is on the viewer's side
    const Vec3 color = s.color * s.area_on_screen;
    const Vec3 g = s.sweep * -nd;  // J carries |n . d|
    const Mask edge_moves = s.active & edge_moving(scene, s.edge);
    mode.edge_end(edge_moves, 0, s.edge, g * (1.0f - s.u), color);
    mode.edge_end(edge_moves, 1, s.edge, g * s.u, color);
    // Slide: n (g . d)/(n . d) with the |n . d| of J cancelled: bounded at grazing views.
    const Mask x_moves = s.active & (gather(scene.face_moving, s.x.face) != 0);
    if (any(x_moves)) {
        const Vec3 point = s.x.normal * (dot(s.sweep, s.direction) * s.lambda);
        triangle_blocks(mode, x_moves, s.x.face, s.x.triangle, s.x.b1, s.x.b2, point, zero3(), color);
    }
    if (asked.want_camera) {
        // x also moves with its pixel's ray: block S gives the ray what of the slide is not along it.
        const Vec3 along = s.x.normal * dot(s.sweep, s.direction);
        Float row[kCameraFloats];
        const Projection ray = project(scene.camera, s.x.position, {splat(0.0f), splat(0.0f)});
        ray_velocity_row(scene.camera, ray, (s.sweep * nd - along) * s.lambda, row);
        mode.camera(s.active, row, color);
    }
    const EmitterSample& e = s.emitter;
    const Mask on_triangle = s.active & e.active & (e.kind == kEmissiveTriangle);
    if (!any(on_triangle)) return;
    const Mask y_moves =
        on_triangle & (gather(scene.face_moving, select(on_triangle, e.index, splat(0))) != 0);
    if (any(y_moves))
        triangle_blocks(mode, y_moves, e.index, e.triangle, e.b1, e.b2, g * (s.lambda - 1.0f), zero3(),
                        color);
}

static void shadow_forward_kernel(const SceneView& scene, const BoundaryTask& task,
                                  const DerivativeView& tangent, Splats& splats) {
    PieceCursor piece = first_piece(task);
    for (int64_t at = 0; at < task.count; at += W) {
        const ShadowSample s =
            sample_shadow(scene, task, at, piece, tangent.want_camera, [](Int) { return splat(-1); });
        Forward mode{scene, tangent};
        if (any(s.active)) shadow_blocks(mode, scene, s, tangent);
        const Int row = quotient(s.pixel, scene.camera.width);
        write_splats(task, splats, at, s.active, to_float(s.pixel - row * scene.camera.width) + 0.5f,
                     to_float(row) + 0.5f, mode.value);
    }
}

static void shadow_backward_kernel(const SceneView& scene, const BoundaryTask& task, const float* adjoint,
                                   DerivativeView& gradient) {
    PieceCursor piece = first_piece(task);
    for (int64_t at = 0; at < task.count; at += W) {
        const ShadowSample s = sample_shadow(scene, task, at, piece, gradient.want_camera, [&](Int pixel) {
            return largest_component(gather3(adjoint, pixel)) > 0.0f;
        });
        if (!any(s.active)) continue;
        const Vec3 a = gather3(adjoint, s.pixel);
        Backward mode{scene, gradient, a};
        shadow_blocks(mode, scene, s, gradient);
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
