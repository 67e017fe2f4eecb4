#include <algorithm>

#include "engine/decisions/decisions.h"
#include "scene/lights/light_params.h"
#include "scene/sharp_lobes.h"
#include "tasks/render_options.h"

namespace edgegrad {

namespace {

// The meshes with faces in the list of lights.
std::vector<int32_t> emissive_meshes(const SceneView& scene, const SceneTables& tables) {
    std::vector<int32_t> out;
    if (!scene.lights.face_light) return out;
    for (int32_t mesh = 0; mesh < tables.visible_meshes; ++mesh) {
        const auto m = static_cast<size_t>(mesh);
        const int32_t *first = scene.lights.face_light + tables.mesh_first_face[m],
                      *last = scene.lights.face_light + tables.mesh_first_face[m + 1];
        if (std::any_of(first, last, [](int32_t light) { return light >= 0; })) out.push_back(mesh);
    }
    return out;
}

}  // namespace

std::vector<int32_t> camera_sampled_materials(const SceneView& scene, const SceneTables& tables,
                                              float reflected, float transmitted, bool perfect) {
    return used_materials(tables, [&](size_t closure) {
        const float alpha = tables.closure_flags[closure] & kHasRefraction ? transmitted : reflected;
        const bool glossy = tables.closure_flags[closure] & (kHasGlossy | kHasRefraction);
        const bool textured = scene.textures.closure_program && scene.textures.closure_program[closure] >= 0;
        return (perfect && may_be_specular(tables, closure)) ||
               has_sharp_lobe(tables, closure, alpha, kWeakCameraSampled) ||
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
    return emissive_meshes(scene, tables);
}

std::vector<int32_t> lights_without_size(const SceneTables& tables, int32_t seen_by) {
    std::vector<int32_t> out;
    for (size_t row = 0; row < tables.lights.kind.size(); ++row)
        if (!is_sized(tables.lights.kind[row]) && (tables.lights.visible_to[row] & seen_by))
            out.push_back(static_cast<int32_t>(row));
    return out;
}

FurtherShadows missing_further_shadows(const SceneView& scene, const SceneTables& tables) {
    FurtherShadows out{lights_without_size(tables, kScatteredRays), {}};
    if (camera_sampled_emitters(scene, tables).empty()) out.meshes = emissive_meshes(scene, tables);
    return out;
}

}  // namespace edgegrad
