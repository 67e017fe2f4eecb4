// The shader of a surface point: one leaf of its material, with the values of its textures.
#pragma once

#include "sampling/sobol.h"
#include "scene/geometry.h"

namespace edgegrad::EDGEGRAD_ISA {

// A material is the sum of weighted leaves. One is picked in proportion to the weights and scaled by their
// sum: an unbiased estimate of all of them at the cost of one.
struct Shader {
    Int leaf;
    Int kind, flags;
    Float scale;                 // sum of the weights
    Float row[kMaterialParams];  // the leaf's values (scene/material_params.h)

    EG_INLINE Vec3 color(int place) const { return {row[place], row[place + 1], row[place + 2]}; }
};

// Loads `count` values of the leaves' rows from `place` on.
EG_INLINE void load_row(const SceneView& scene, Shader& s, int place, int count) {
    for (int k = place; k < place + count; ++k)
        s.row[k] = gather(scene.leaf_params + k, s.leaf * static_cast<int32_t>(kMaterialParams));
}

EG_INLINE Int pick_leaf(const SceneView& scene, const SurfacePoint& x, Float u, Float& scale) {
    Int leaf = gather(scene.material_first_leaf, x.material);
    scale = splat(1.0f);
    if (!scene.any_mixture) return leaf;
    for (int i = 0; i < W; ++i) {
        if (!x.active[i]) continue;
        const int32_t first = leaf[i], last = scene.material_first_leaf[x.material[i] + 1];
        if (last - first == 1) continue;
        float sum = 0.0f;
        for (int32_t k = first; k < last; ++k) sum += scene.leaf_params[k * kMaterialParams + kWeight];
        float left = u[i] * sum;
        int32_t k = first;
        while (k + 1 < last && left >= scene.leaf_params[k * kMaterialParams + kWeight])
            left -= scene.leaf_params[k++ * kMaterialParams + kWeight];
        leaf[i] = k;
        scale[i] = sum;
    }
    return leaf;
}

// The shader at x for the random number u.
EG_INLINE Shader surface_shader(const SceneView& scene, const SurfacePoint& x, Float u) {
    Shader s;
    s.leaf = pick_leaf(scene, x, u, s.scale);
    s.kind = gather(scene.leaf_kind, s.leaf);
    s.flags = gather(scene.leaf_flags, s.leaf);
    load_row(scene, s, kBaseColor, 3);
    if (scene.all_flags & kHasEmission) load_row(scene, s, kEmission, 3);
    return s;
}

EG_INLINE Mask has(const Shader& s, int32_t flag) { return (s.flags & flag) != 0; }

}  // namespace edgegrad::EDGEGRAD_ISA
