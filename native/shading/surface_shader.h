// The shader of a surface point: one closure of its material, with textured values.
#pragma once

#include "scene/geometry.h"
#include "shading/value_ranges.h"
#include "texture/normal_map.h"
#include "texture/program.h"

namespace edgegrad::EDGEGRAD_ISA {

// A material is a weighted sum of closures. One closure is chosen in proportion to the weights and multiplied
// by their sum. This is an unbiased estimate of all closures at the cost of one.
struct Shader {
    Int closure;
    Int kind, flags;
    Float scale;                 // sum of the weights
    Float row[kMaterialParams];  // the closure's values (scene/material_params.h)

    EG_INLINE Vec3 color(int place) const { return {row[place], row[place + 1], row[place + 2]}; }
};

// Loads N values of the closures' rows, starting at `place`.
template <int N>
EG_INLINE void load_row(const SceneView& scene, Shader& s, int place) {
    Float values[N];
    gather_row(scene.closure_params + place, kMaterialParams, s.closure, values);
    for (int k = 0; k < N; ++k) s.row[place + k] = values[k];
}

// The number of closures of a material.
EG_INLINE Int closure_count(const SceneView& scene, Int material) {
    return gather(scene.material_first_closure + 1, material) -
           gather(scene.material_first_closure, material);
}

// Whether a closure of a material has one of these flags.
EG_INLINE bool material_has(const SceneView& scene, int32_t material, int32_t flags) {
    for (int32_t k = scene.material_first_closure[material]; k < scene.material_first_closure[material + 1];
         ++k)
        if (scene.closure_flags[k] & flags) return true;
    return false;
}

// The smooth normal of displaced surfaces: `point.normal`, bent by the material's own program, whose vectors
// may have any length.
EG_OUTLINE Vec3 displaced_normal(const SceneView& scene, Mask active, Int material,
                                 const TexturePoint& point) {
    const Int closure = gather(scene.material_first_closure, material);
    Float row[kMaterialParams];
    row[kNormalMap] = point.normal.x, row[kNormalMap + 1] = point.normal.y,
    row[kNormalMap + 2] = point.normal.z;
    run_program(scene, active, gather(scene.textures.closure_normal_program, closure), point, row);
    return normalized_or(Vec3{row[kNormalMap], row[kNormalMap + 1], row[kNormalMap + 2]}, point.normal);
}

// `way`: from the last scattering event to the surface.
EG_INLINE RayHistory ray_history(const SceneView& scene, Int bounces, Vec3 way) {
    if (!scene.textures.reads_history && scene.least_alpha == 0.0f) return unknown_history();
    return {bounces, sqrt(max(dot(way, way), 1e-30f))};
}

// The history of paths of boundary samples. Their textures do not read it (the part kRayHistories is
// missing).
EG_INLINE RayHistory boundary_history(const SceneView& scene, Int bounces) {
    if (scene.least_alpha == 0.0f) return unknown_history();
    return {bounces, splat(0.0f)};
}

EG_INLINE RayHistory behind_diffuse(const SceneView& scene) { return boundary_history(scene, splat(1)); }

EG_INLINE TexturePoint texture_point(const SceneView& scene, const SurfacePoint& x, Vec3 view, Int ray_kind,
                                     const RayHistory& history = unknown_history()) {
    const Vec3 smooth = smooth_normal(scene, x);
    TexturePoint point = {x.face, x.instance,    x.b1,     x.b2,     x.position, smooth,
                          view,   x.side < 0.0f, ray_kind, x.normal, smooth,     history};
    if (scene.textures.closure_normal_program)
        point.normal = displaced_normal(scene, x.active, x.material, point);
    return point;
}

// Weight of the closure in its mixture.
EG_OUTLINE Float closure_weight(const SceneView& scene, Mask active, Int closure, const TexturePoint& point) {
    Float row[kMaterialParams];
    row[kWeight] = gather(scene.closure_params + kWeight, closure * static_cast<int32_t>(kMaterialParams));
    if (scene.textures.closure_weight_program)
        run_program(scene, active, gather(scene.textures.closure_weight_program, closure), point, row);
    return max(row[kWeight], 0.0f);
}

// Chooses a closure of x's material by the random number u. `scale` becomes the sum of the closures' weights.
EG_INLINE Int pick_closure(const SceneView& scene, const SurfacePoint& x, const TexturePoint& point, Float u,
                           Float& scale) {
    const Int first = gather(scene.material_first_closure, x.material);
    scale = splat(1.0f);
    if (!scene.any_mixture) return first;
    const Int count = closure_count(scene, x.material);
    const Mask mixed = x.active & (count > 1);
    if (!any(mixed)) return first;
    // One pass over the weights: each closure replaces the previous choice with the probability weight / (sum
    // of the weights so far), and the remainder of u is reused (reservoir sampling, Chao 1982).
    Float sum = splat(0.0f);
    Int closure = first;
    for (Int k = splat(0); any(mixed & (k < count)); k = k + 1) {
        const Mask here = mixed & (k < count);
        const Int candidate = select(here, first + k, first);
        const Float weight = select(here, closure_weight(scene, here, candidate, point), splat(0.0f));
        sum = sum + weight;
        const Float share = weight / max(sum, 1e-30f);
        const Mask taken = here & (u < share);
        closure = select(taken, candidate, closure);
        u = select(here,
                   min(select(taken, u / max(share, 1e-30f), (u - share) / max(1.0f - share, 1e-30f)),
                       splat(0.99999994f)),
                   u);
    }
    scale = select(mixed, sum, scale);
    return closure;
}

// Evaluates a closure at x.
EG_OUTLINE Shader closure_shader(const SceneView& scene, const SurfacePoint& x, Int closure,
                                 const TexturePoint& point) {
    Shader s;
    s.closure = closure;
    s.scale = splat(1.0f);
    s.kind = gather(scene.closure_kind, s.closure);
    s.flags = gather(scene.closure_flags, s.closure);
    if (scene.common_flags & kLambertian) {
        load_row<3>(scene, s, kBaseColor);
        if (scene.all_flags & kHasEmission) load_row<3>(scene, s, kEmission);
        if (scene.all_flags & kHasTransparency) load_row<1>(scene, s, kAlpha);
        if (scene.all_flags & kHasNormalMap) load_row<4>(scene, s, kNormalMap);
    } else {
        load_row<kShaderParams>(scene, s, 0);
        s.row[kThinFilmIor] = splat(1.0f);
        if (scene.all_flags & kThinFilm) load_row<1>(scene, s, kThinFilmIor);
    }
    if (scene.textures.closure_program) {
        run_program(scene, x.active, gather(scene.textures.closure_program, s.closure), point, s.row);
        keep_in_ranges(s.row, scene.all_flags, scene.common_flags & kLambertian);
    }
    return s;
}

EG_INLINE Shader surface_shader(const SceneView& scene, const SurfacePoint& x, const TexturePoint& point,
                                Float u) {
    Float scale;
    const Int closure = pick_closure(scene, x, point, u, scale);
    Shader s = closure_shader(scene, x, closure, point);
    s.scale = scale;
    return s;
}

EG_INLINE Mask has(const Shader& s, int32_t flag) { return (s.flags & flag) != 0; }

// The shading normal: that of the closure's normal map, or the one that its program computes.
EG_INLINE Vec3 shading_normal(const SceneView& scene, Mask active, const Shader& s,
                              const TexturePoint& point) {
    if (!(scene.all_flags & kHasNormalMap)) return point.normal;
    const Mask bent = active & has(s, kHasNormalMap);
    const Vec3 value = s.color(kNormalMap);
    if (!(scene.all_flags & kNormalInWorld))
        return mapped_normal(scene, bent, uv_map(scene.textures, s.closure), point, value,
                             s.row[kNormalStrength]);
    const Mask computed = bent & has(s, kNormalInWorld);
    const Vec3 mapped = mapped_normal(scene, bent & ~computed, uv_map(scene.textures, s.closure), point,
                                      value, s.row[kNormalStrength]);
    return select(computed, normalized_or(value, point.normal), mapped);
}

// Share of light that passes the surface unscattered; `color` is its tint.
EG_INLINE Float passing_share(const Shader& s, Vec3& color) {
    const Mask clear = s.kind == splat(kTransparent);
    const Vec3 white = one3();
    color = select(clear, s.color(kBaseColor), white);
    return select(clear, splat(1.0f), select(has(s, kHasTransparency), 1.0f - s.row[kAlpha], 0.0f));
}

}  // namespace edgegrad::EDGEGRAD_ISA
