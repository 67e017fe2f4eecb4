// The step of the reflected radiance across an edge between two Lambertian faces at a small angle,
//   L+ - L- = int (f+ |n+.w| - f- |n-.w|) L(w) dw.
// One path estimates both sides with common directions, light samples and shadow rays. Distant light then
// cancels before it is multiplied by noise. The variance decreases with the square of the angle between the
// faces. With one path for each side it would decrease only linearly, because their visibilities are
// independent.
#pragma once

#include "path/scatter.h"
#include "path/shaded_surface.h"
#include "tasks/image_task.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

struct LambertianStep {
    Vec3 normal;  // mean of the two sides' normals
    Lambertian plus, minus;
    // Lanes under a constant environment whose unoccluded integral is known. Only its occlusion is sampled.
    Mask environment_is_known;

    static constexpr bool kSmooth = true;
    // Each side has its own horizon.
    EG_INLINE Mask both_sides() const { return splat(-1); }

    EG_INLINE static Float density(const Lambertian& side, Vec3 w) {
        const Float cosine = dot(side.normal, w);
        return select(cosine > 0.0f, 0.5f * kInvPi * cosine + 0.25f * kInvPi, splat(0.0f));
    }
    EG_INLINE BsdfValue evaluate(Mask active, Vec3 w) const {
        const Vec3 a = plus.evaluate(active & (dot(plus.ng, w) > 0.0f), w).value;
        const Vec3 b = minus.evaluate(active & (dot(minus.ng, w) > 0.0f), w).value;
        return {a - b, 0.5f * (density(plus, w) + density(minus, w))};
    }
    EG_INLINE BsdfValue evaluate_for(Int kinds, Mask active, Vec3 w) const {
        BsdfValue f = evaluate(active, w);
        f.value = select((kinds & (1 << kDiffuseRay)) != 0, f.value, zero3());
        return f;
    }
    EG_INLINE BsdfSample sample(Mask active, Float lobe_u, Float u, Float v) const {
        const Mask first = lobe_u < 0.5f;
        BsdfSample s;
        s.wi = mixed_direction(select(first, plus.normal, minus.normal), u, v);
        const BsdfValue f = evaluate(active, s.wi);
        s.pdf = f.pdf;
        s.active = active & (f.pdf > 0.0f) & (largest_component(f.value) > 0.0f);
        s.weight = f.value * (1.0f / max(f.pdf, 1e-30f));
        s.lobe = splat(0);
        s.specular = s.transmitted = splat(0);
        s.ray_kind = splat(kDiffuseRay);
        return s;
    }
};

// Scatters paths at x and at the face `other` on the edge's other side. Subtracts the radiance of `other`.
EG_OUTLINE int scatter_step(const SceneView& scene, const ImageTask& task, Workspace& work, PathPacket p,
                            const SurfacePoint& x, const TexturePoint& point, const Shader& shader, Int other,
                            Float b1, Float b2, const PathIndex& index, Float lobe_u, int alive) {
    SurfacePoint y = surface_point(scene, p.active, other, b1, b2, p.direction, x.instance);
    y.mesh = x.mesh;
    p.active &= y.active;
    const TexturePoint beside = texture_point(scene, y, -p.direction, p.kind, point.history);
    const Vec3 albedo[2] = {shader.color(kBaseColor),
                            surface_shader(scene, y, beside, lobe_u).color(kBaseColor)};
    const Vec3 normal = unit_vector(x.normal + y.normal);
    const auto flat = [](Vec3 smooth, Vec3 n) {
        return (smooth.x == n.x) & (smooth.y == n.y) & (smooth.z == n.z);
    };
    LambertianStep surface{
        normal, {point.normal, x.normal, albedo[0]}, {beside.normal, y.normal, albedo[1]}, splat(0)};
    const Int diffuse = splat(kDiffuseRay);
    if (scene.has_environment && !scene.environment_image.pixels) {
        surface.environment_is_known = p.active & flat(point.normal, x.normal) &
                                       flat(beside.normal, y.normal) & next_is_final(task, p, diffuse);
        const Mask seen =
            surface.environment_is_known & ((splat(scene.environment_mask) & ray_mask(diffuse)) != 0);
        if (any(seen))
            add_radiance(work, p, seen, p.throughput * (albedo[0] - albedo[1]) * splat3(scene.environment));
    }
    // Rays must leave in front of both faces, also those below the plane between the faces.
    SurfacePoint both = x;
    both.normal = normal;
    both.position = x.position + normal * x.offset;
    both.offset = splat(0.0f);
    return scatter(scene, task, work, p, both, surface, index, lobe_u, alive, nullptr);
}

}  // namespace edgegrad::EDGEGRAD_ISA
