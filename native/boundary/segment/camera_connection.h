// The camera's connection to a point x that light has reached from elsewhere. As an integral over surfaces,
// the value of a pixel is
//   I = int h(s(x)) kappa |D . n| V(x) L(x, wo) dA,
// where s(x) is the place of x in the picture, h the pixel's filter, D the direction of the ray through it,
// and kappa the picture's area per area perpendicular to D (path/camera_projection.h). V is the transmittance
// between camera and x.
#pragma once

#include "boundary/segment/camera_sampled_lobes.h"
#include "film/splat.h"
#include "path/lens_sample.h"
#include "path/shaded_surface.h"
#include "path/stream.h"
#include "shading/lambertian.h"
#include "shading/transmittance.h"

namespace edgegrad::EDGEGRAD_ISA {

// The projection of x through a random point of the lens. Inactive if x is outside the frame.
EG_INLINE Projection place_in_picture(const SceneView& scene, Mask active, Vec3 x, const PathIndex& random) {
    const CameraView& c = scene.camera;
    const LensPoint lens = lens_of(c, random);
    Projection view = project(c, x, lens);
    view.active &=
        active & in_reach(c, view.sx, view.sy) & (view.distance > view.near) & (view.distance < view.far);
    return view;
}

// V: the transmittance between the camera and x. `most_transparent` is the picture's limit of transparent
// surfaces.
EG_INLINE Vec3 seen_by_camera(const SceneView& scene, Mask active, const SurfacePoint& x,
                              const Projection& view, int most_transparent) {
    const Vec3 start = leave_surface(x);
    const Float to_near_plane = 1.0f - view.near / max(view.distance, 1e-30f);
    return transmittance(scene, active, start, view.origin - start, to_near_plane,
                         {splat(1 << kCameraRay), kCameraRay, most_transparent});
}

// f |n_s . w| / |n . w| for light from w that x scatters by `shader` towards point.view. Both are unit
// vectors from x, and x's normal is on the side of the view. The BSDF is that of the picture, times the
// opaque fraction. `light_kinds` are the kinds of scattering (bits 1 << RayKind) to which the light is
// visible. What is `followed` is left out: scan lines find it.
EG_OUTLINE Vec3 scattered_by(const SceneView& scene, const SurfacePoint& x, const TexturePoint& point,
                             const Shader& shader, Vec3 w, Int light_kinds,
                             const Followed& followed = splat(0.0f)) {
    const Vec3 normal = shading_normal(scene, x.active, shader, point);
    const bool all_kinds = !any((light_kinds & kScatteredRays) != kScatteredRays);
    const auto evaluate = [&](const auto& surface, Mask m) EG_INLINE_LAMBDA {
        return evaluate_kinds(surface, all_kinds, light_kinds, m, w).value;
    };
    const Float above = dot(x.normal, w);
    const Mask lambertian = x.active & has(shader, kLambertian), others = x.active & ~lambertian;
    Vec3 value = zero3();
    Mask lit = lambertian & (above > 0.0f);
    if (any(lit)) {
        const Vec3* smooth = scene.all_flags & kHasNormalMap ? &point.normal : nullptr;
        const Lambertian surface{normal, x.normal, shader.color(kBaseColor), smooth};
        value = select(lit, evaluate(surface, lit), value);
    }
    if (any(others)) {
        ShadedSurface surface = shaded_surface(scene, others, x, point, shader, normal);
        if (any(followed.widest > 0.0f)) follow_lobes(surface.bsdf, others, followed);
        const Mask reached = others & (surface.both_sides() | (above > 0.0f));
        value = select(reached, evaluate(surface, reached), value);
        lit |= reached;
    }
    Float scale = shader.scale / max(abs(above), 1e-20f);
    if (scene.all_flags & kHasTransparency) {
        Vec3 color;
        scale = scale * (1.0f - passing_share(shader, color));
    }
    return select(lit, value * scale, zero3());
}

// The part of it that is `followed`.
EG_INLINE Vec3 followed_part(const SceneView& scene, const SurfacePoint& x, const TexturePoint& point,
                             const Shader& shader, Vec3 w, Int light_kinds, Vec3 all,
                             const Followed& followed) {
    return all - scattered_by(scene, x, point, shader, w, light_kinds, followed);
}

// The part of it that x throws, with its normal towards the viewer (path/lights/thrown_light.h). Caustics
// have it (boundary/caustics/caustic_path.h).
EG_INLINE Vec3 thrown_part(const SceneView& scene, const SurfacePoint& x, const TexturePoint& point,
                           const Shader& shader, Vec3 w, Int light_kinds, Vec3 all, const Followed& thrown) {
    return followed_part(scene, x, point, shader, w, light_kinds, all, thrown.reflections()) *
           share_above(dot(x.normal, w));
}

// `scattered_by` towards a ray of `kind`, for one of the material's closures, picked by `choice`. Lanes of
// `without_sampled` leave out the `camera_sampled` lobes. Sets `part`, if not null, to the part that
// is `followed`.
EG_INLINE Vec3 scattered_towards(const SceneView& scene, const SurfacePoint& x, Vec3 view, Vec3 w, Int kind,
                                 Int light_kinds, Float choice, Mask without_sampled = splat(0),
                                 const CameraSampledLobes& camera_sampled = {}, Vec3* part = nullptr,
                                 const Followed& followed = splat(0.0f)) {
    const TexturePoint point = texture_point(scene, x, view, kind);
    const Shader shader = surface_shader(scene, x, point, choice);
    const Int kinds = light_kinds & ~(without_sampled & camera_sampled_kinds(shader, camera_sampled));
    const Vec3 all = scattered_by(scene, x, point, shader, w, kinds);
    if (part) *part = followed_part(scene, x, point, shader, w, kinds, all, followed);
    return all;
}

// Subtracts from `all` the light of chains of followed lobes, which scan lines sample
// (boundary/specular/chain_term.h). A difference within rounding counts as zero.
EG_INLINE Vec3 without_followed(Vec3 all, Vec3 followed) {
    constexpr float kRounding = 1e-5f;
    const auto rest = [&](Float a, Float b) { return select(a - b > kRounding * a, a - b, splat(0.0f)); };
    return {rest(all.x, followed.x), rest(all.y, followed.y), rest(all.z, followed.z)};
}

}  // namespace edgegrad::EDGEGRAD_ISA
