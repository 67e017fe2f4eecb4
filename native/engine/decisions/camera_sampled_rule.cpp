#include <algorithm>

#include "engine/decisions/decisions.h"
#include "scene/sharp_lobes.h"
#include "tasks/render_options.h"

namespace edgegrad {

std::vector<int32_t> camera_sampled_materials(const SceneView& scene, const SceneTables& tables,
                                              float reflected, float transmitted) {
    return used_materials(tables, [&](size_t closure) {
        const float alpha = tables.closure_flags[closure] & kHasRefraction ? transmitted : reflected;
        const bool glossy = tables.closure_flags[closure] & (kHasGlossy | kHasRefraction);
        const bool textured = scene.textures.closure_program && scene.textures.closure_program[closure] >= 0;
        return has_sharp_lobe(tables, closure, alpha, kWeakCameraSampled) ||
               (alpha > 0.0f && glossy && textured && tables.closure_kind[closure] != kSheen &&
                tables.closure_kind[closure] != kVelvet);
    });
}

std::vector<int32_t> camera_sampled_emitters(const SceneView& scene, const SceneTables& tables) {
    constexpr int32_t kClear = kHasEmission | kHasTransparency;
    const auto clear = [](int32_t flags) { return (flags & kClear) == kClear; };
    if (!scene.lights.face_light ||
        std::any_of(tables.closure_flags.begin(), tables.closure_flags.end(), clear) ||
        !partly_met_meshes(tables, kScatteredRays | 1 << kShadowRay).empty())
        return {};
    std::vector<int32_t> out;
    for (int32_t mesh = 0; mesh < tables.visible_meshes; ++mesh) {
        const auto m = static_cast<size_t>(mesh);
        const int32_t *first = scene.lights.face_light + tables.mesh_first_face[m],
                      *last = scene.lights.face_light + tables.mesh_first_face[m + 1];
        if (std::any_of(first, last, [](int32_t light) { return light >= 0; })) out.push_back(mesh);
    }
    return out;
}

}  // namespace edgegrad
