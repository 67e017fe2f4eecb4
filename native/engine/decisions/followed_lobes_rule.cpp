#include "engine/decisions/followed_lobes_rule.h"

#include <algorithm>

#include "boundary/curves/light_intersections.h"
#include "engine/decisions/decisions.h"
#include "scene/lights/light_list.h"
#include "scene/lights/light_params.h"
#include "scene/sharp_lobes.h"
#include "scene/textures/jumps.h"

namespace edgegrad {
namespace {

// Limits of alpha: in scenes with emissive meshes or sized lights of the table, and in all others. Wider
// lobes have less noise if they are not followed: edges are sampled along them
// (boundary/terms/camera_sampled.h), which scan lines find only by chance, and lights are sampled. Where no
// lobe is followed, light keeps its direction near contact at more surfaces of a path
// (fixed_direction_surfaces).
constexpr float kFollowedByEmitters = 0.0205f, kFollowedAlpha = kWidestFollowed;
// The same in scenes of distance fields with sized lights of the table. Fields have no other estimator for
// the light that they hide from narrower lobes.
constexpr float kFollowedByFields = 0.0505f;

// Whether radiance may jump within a surface: a mesh has a textured material, or textures jump on a field.
// Fields have no seams.
bool may_jump_within_surfaces(const SceneTables& tables) {
    const auto& programs = tables.textures.closure_program;
    if (std::all_of(programs.begin(), programs.end(), [](int32_t program) { return program < 0; }))
        return false;
    const auto textured = [&](int32_t material, const auto& counts) {
        const auto m = static_cast<size_t>(material);
        for (auto k = static_cast<size_t>(tables.material_first_closure[m]);
             k < static_cast<size_t>(tables.material_first_closure[m + 1]); ++k)
            if (programs[k] >= 0 && counts(k)) return true;
        return false;
    };
    const int32_t first =
        tables.fields.empty() ? static_cast<int32_t>(tables.face_material.size()) : tables.first_field_face();
    const auto end = static_cast<int32_t>(tables.face_material.size());
    for (int32_t face = 0; face < end; ++face) {
        const bool on_field = face >= first && face < first + static_cast<int32_t>(tables.fields.size());
        if (textured(tables.face_material[static_cast<size_t>(face)],
                     [&](size_t closure) { return !on_field || texture_jumps(tables, closure).any(); }))
            return true;
    }
    return false;
}

// Whether light of the table may jump within faces: at borders of spots without blend, for lights without
// size where smooth-shaded faces turn away from them, and behind smooth surfaces whose normals a map bends.
bool lights_jump(const SceneTables& tables, const LightView& lights) {
    const auto& flags = tables.closure_flags;
    if (lights.sized_count + lights.sized_distant > 0 &&
        std::any_of(flags.begin(), flags.end(), [](int32_t f) { return (f & kHasNormalMap) != 0; }))
        return true;
    if ((lights.kinds & kPointlikeLights) && !tables.corner_normal.empty()) return true;
    return !hard_cones(tables.lights).empty();
}

// Whether surfaces pass through lights anywhere in the scene.
bool lights_cross(const EdgeList& edges) {
    RequestedMotion all;
    all.moving.assign(static_cast<size_t>(edges.tables.visible_meshes), 1);
    all.camera = all.instances = all.lights = true;
    const Intersections found = find_intersections(edges, all, kScatteredRays | 1 << kShadowRay);
    return find_light_intersections(edges.tables, all, found, nullptr, edges.threads).size() > 0 ||
           find_disk_intersections(edges.tables, edges.threads).size() > 0;
}

float widest_followed(const SceneTables& tables, const LightView& lights) {
    const bool sized = lights.sized_count + lights.sized_distant > 0;
    if (!tables.fields.empty()) return sized ? kFollowedByFields : kFollowedAlpha;
    return sized || lights.face_light ? kFollowedByEmitters : kFollowedAlpha;
}

}  // namespace

float followed_alpha(const EdgeList& edges, const RequestedMotion& motion) {
    const SceneTables& tables = edges.tables;
    const LightView& lights = edges.lights->view();
    const float widest = widest_followed(tables, lights);
    if (!motion.any() || !may_be_specular(tables, widest) || may_jump_within_surfaces(tables) ||
        lights_jump(tables, lights))
        return 0.0f;
    return *edges.kept.cross.get(true, [&] { return lights_cross(edges); }) ? 0.0f : widest;
}

}  // namespace edgegrad
