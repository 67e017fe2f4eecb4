// Interior term: the derivative of L at fixed pixel samples, where nothing jumps.
//
// The first hit x slides: its pixel's ray is fixed, so x moves by d (n . m)/(n . d), m the material
// velocity of its triangle (derivations, block S). A point y of an emitter rides on its triangle at
// fixed barycentrics (material form), its density detached. Written with the sample's value
//   h = albedo/pi L_e (n . w)(-w . M_y)/(2 r^2 P)
// the derivatives with respect to y, x, n and M_y are (derivations A1), with h0 = h/(c1 c2),
// c1 = n . w, c2 = -w . M_y:
//   y: (h0/r)(n c2 - M_y c1 - 4 w c1 c2),  x: minus that,  n: h0 c2 w,  M_y: -h0 c1 w.
// Point lights and suns: section D. Constant environment: only n turns,
//   int L (dn . w) V dw  =  - int L (dn . w) (1 - V) dw ,
// since without V the integral of w over the hemisphere is pi n, and dn is orthogonal to n. The right
// side needs only the blocked directions: exactly zero, without noise, on convex bodies. Half of the
// directions are uniform: with cosine-weighted ones alone the variance of 1/cos is infinite.
#pragma once

#include "path/blocks.h"
#include "path/stream.h"

namespace edgegrad::EDGEGRAD_ISA {

// Direction of density p(w) = (cos/pi + 1/(2 pi))/2 on the hemisphere of n; its cosine.
EG_INLINE Vec3 mixed_direction(Vec3 n, Float strategy, Float u, Float v, Float& cosine, Float& density) {
    Vec3 a, b;
    basis(n, a, b);
    Float s, c;
    sincos_turn(v, s, c);
    const Mask uniform = strategy < 0.5f;
    cosine = select(uniform, 1.0f - u, sqrt(max(1.0f - u, 0.0f)));
    const Float sine = sqrt(max(1.0f - cosine * cosine, 0.0f));
    density = (0.5f * kInvPi) * (cosine + 0.5f);
    return a * (sine * c) + b * (sine * s) + n * cosine;
}

// Adjoints of the surface point's own quantities per unit of `color`.
struct PointAdjoint {
    Vec3 position = zero3();
    Vec3 normal = zero3();  // of the unit normal
};

// S and N of the first hit: q = n (g . d)/(n . d) for the slide; for the unit normal
// g <- side (g - n (n . g))/|M|.
template <typename Mode>
EG_INLINE void slide_blocks(Mode& mode, const QueuedHit& q, Mask moves, const PointAdjoint& g, Vec3 color) {
    const SurfacePoint& x = q.point;
    const Float nd = dot(x.normal, q.direction);
    moves &= nd != 0.0f;
    if (!any(moves)) return;
    const Vec3 point = x.normal * (dot(g.position, q.direction) / select(nd != 0.0f, nd, 1.0f));
    const Vec3 normal = (g.normal - x.normal * dot(x.normal, g.normal)) * (x.side / x.length_m);
    triangle_blocks(mode, moves, x.face, x.triangle, x.b1, x.b2, point, normal, color);
}

template <typename Mode>
EG_INLINE void emitter_interior(Mode& mode, const SceneView& scene, const DerivativeView& d,
                                const QueuedHit& q, Mask lit, Mask x_moves, Vec3 albedo,
                                const LightRandom& random) {
    SurfacePoint x = q.point;
    x.active = lit;
    EmitterSample s = sample_emitter(scene, lit, x, random.emitter_u, random.emitter_v);
    if (!scene.convex) s.active &= ~emitter_hidden(scene, x, s);
    if (!any(s.active)) return;
    const Float value = select(s.active, s.geometry * s.cosine * kInvPi, 0.0f);  // h over albedo L_e
    const Mask is_triangle = s.active & (s.kind == kEmissiveTriangle);
    const Mask is_point = s.active & (s.kind == kPointLight);
    const Mask is_sun = s.active & (s.kind == kSunLight);
    const Int emitter_material = gather(scene.face_material, select(is_triangle, s.index, splat(0)));
    if (d.want_colors) {
        mode.row(s.active, d.albedo, x.material, s.radiance * value);
        if (any(is_triangle)) mode.row(is_triangle, d.emission, emitter_material, albedo * value);
        if (any(is_point)) mode.row(is_point, d.point_intensity, s.index, albedo * value);
        if (any(is_sun)) mode.row(is_sun, d.sun_irradiance, s.index, albedo * value);
    }
    if (!d.want_vertices) return;
    const Mask y_moves =
        is_triangle & (gather(scene.face_moving, select(is_triangle, s.index, splat(0))) != 0);
    x_moves &= s.active;
    if (!any(x_moves | y_moves)) return;

    const Vec3 color = albedo * s.radiance;
    const Float c1 = s.cosine;
    const Float inv_r = select(is_sun, splat(0.0f), 1.0f / max(s.r, 1e-30f));
    // Triangle: h0 = 1/(2 pi r^2 P); point: h0 = 1/(pi r^2 P) with c2 -> 1, M_y -> 0.
    const Float c2 = select(is_triangle, -dot(s.w, s.m), splat(1.0f));
    const Vec3 m = select(is_triangle, s.m, zero3());
    const Float h0 = s.geometry * kInvPi / select(c2 != 0.0f, c2, 1.0f);
    const Float power = select(is_triangle, splat(4.0f), splat(3.0f));
    const Vec3 y = (x.normal * c2 - m * c1 - s.w * (power * c1 * c2)) * (h0 * inv_r);
    PointAdjoint g;
    g.position = -y;
    g.normal = s.w * (h0 * c2);
    slide_blocks(mode, q, x_moves, g, color);
    if (any(y_moves))
        triangle_blocks(mode, y_moves, s.index, s.triangle, s.b1, s.b2, y, s.w * (-h0 * c1 * s.side), color);
}

template <typename Mode>
EG_INLINE void environment_interior(Mode& mode, const SceneView& scene, const DerivativeView& d,
                                    const QueuedHit& q, Mask lit, Mask x_moves, Vec3 albedo,
                                    const LightRandom& random, Float strategy) {
    const SurfacePoint& x = q.point;
    Float cosine, density;
    const Vec3 w =
        mixed_direction(x.normal, strategy, random.environment_u, random.environment_v, cosine, density);
    const Mask hidden = scene.convex ? splat(0) : occluded_from(scene, lit, x, w, splat(__builtin_inff()));
    const Vec3 environment = splat3(scene.environment);
    if (d.want_colors) {
        // int (n.w)/pi V dw = 1 - int (n.w)/pi (1 - V) dw: without noise where nothing is hidden.
        const Float value = 1.0f - select(hidden, cosine * kInvPi / density, 0.0f);
        mode.row(lit, d.albedo, x.material, environment * value);
        mode.row(lit, d.environment, splat(0), albedo * value);
    }
    const Mask turns = x_moves & lit & hidden;
    if (d.want_vertices && any(turns)) {
        PointAdjoint g;
        g.normal = w * (-kInvPi / density);
        slide_blocks(mode, q, turns, g, albedo * environment);
    }
}

template <typename Mode>
EG_INLINE void interior_sample(Mode& mode, const SceneView& scene, const ImageTask& task,
                               const DerivativeView& d, const QueuedHit& q) {
    const SurfacePoint& x = q.point;
    if (d.want_colors) {
        mode.row(on_emitting_side(scene, x), d.emission, x.material,
                 Vec3{splat(1.0f), splat(1.0f), splat(1.0f)});
    }
    if (task.max_depth < 2) return;
    const Vec3 albedo = gather3(scene.albedo, x.material);
    const Mask x_moves = x.active & (gather(scene.face_moving, x.face) != 0);
    // A black surface has no light to lose or turn, but its colour has a derivative.
    const Mask lit = x.active & (d.want_colors ? splat(-1) : largest_component(albedo) > 0.0f);
    if (!any(lit)) return;
    const LightRandom random = light_random(scene, q.index.stream, q.index.sample);
    if (scene.emitter_count > 0) emitter_interior(mode, scene, d, q, lit, x_moves, albedo, random);
    if (scene.has_environment) {
        Float strategy, unused;
        sobol_pair(q.index.stream, q.index.sample, kPairStrategy, strategy, unused);
        // On a convex body nothing is hidden, and only the hidden directions turn.
        const Mask asked = d.want_colors ? lit : scene.convex ? splat(0) : lit & x_moves;
        if (any(asked)) environment_interior(mode, scene, d, q, asked, x_moves, albedo, random, strategy);
    }
}

static void interior_forward_kernel(const SceneView& scene, const ImageTask& task, Workspace& work,
                                    const DerivativeView& tangent, float* image) {
    // A path that meets no surface sees the environment itself.
    const float background[3] = {static_cast<float>(tangent.environment[0]),
                                 static_cast<float>(tangent.environment[1]),
                                 static_cast<float>(tangent.environment[2])};
    const int queued = trace_camera_paths(scene, task, splat3(background), work);
    for (int at = 0; at < queued; at += W) {
        const QueuedHit q = load_hit(scene, task, at, queued, work);
        Forward mode{scene, tangent};
        interior_sample(mode, scene, task, tangent, q);
        scatter_radiance(work, q, mode.value);
    }
    accumulate(task, work, image);
}

static void interior_backward_kernel(const SceneView& scene, const ImageTask& task, Workspace& work,
                                     const float* adjoint, DerivativeView& gradient) {
    // Marks the paths that meet no surface: there the environment's gradient is the adjoint itself.
    const int queued = trace_camera_paths(scene, task, Vec3{splat(1.0f), splat(0.0f), splat(0.0f)}, work);
    for (int at = 0; at < queued; at += W) {
        const QueuedHit q = load_hit(scene, task, at, queued, work);
        const Vec3 a = gather3(adjoint, q.index.pixel + task.first_pixel) * splat(task.weight);
        Backward mode{scene, gradient, select(q.active, a, zero3())};
        interior_sample(mode, scene, task, gradient, q);
        scatter_radiance(work, q, zero3());
    }
    if (!gradient.want_colors) return;
    for (int pixel = 0; pixel < task.pixel_count; ++pixel) {
        double missed = 0.0;
        for (int k = 0; k < task.samples; ++k)
            missed += static_cast<double>(work.radiance[0][pixel * task.samples + k]);
        const float* a = adjoint + 3 * static_cast<int64_t>(task.first_pixel + pixel);
        for (int c = 0; c < 3; ++c)
            gradient.environment[c] += missed * static_cast<double>(a[c] * task.weight);
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
