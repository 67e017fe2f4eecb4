#include "engine/decisions/shading_rules.h"

#include <algorithm>
#include <initializer_list>

#include "engine/decisions/interior_rules.h"
#include "engine/decisions/value_sources.h"
#include "scene/lights/light_params.h"
#include "scene/sharp_lobes.h"

namespace edgegrad {
namespace {

using enum FloatTable;

bool requests_custom_normals(const SceneTables& tables, const FloatSpans& requested) {
    return requested.any(kNormals, 0, tables.normals.size());
}

// Whether only vertices are requested, with the shading normals that depend on them. Custom normals change
// shading without any motion.
bool requests_vertices_alone(const SceneTables& tables, const FloatSpans& requested) {
    return requested.only({kVertices, kNormals}) && !requests_custom_normals(tables, requested);
}

// The columns (bits) of a closure's row that change what the camera sees of the surface without any
// scattering: its emission, and what its layers and its transparency transmit.
uint64_t directly_seen_columns(const SceneView& scene, size_t closure) {
    constexpr uint64_t all = Requested::columns(0, kMaterialParams),
                       lambertian = Requested::columns(kEmission, kEmission + 3) |
                                    Requested::columns(kAlpha, kAlpha + 1) |
                                    Requested::columns(kWeight, kWeight + 1);
    const int32_t flags = scene.closure_flags[closure];
    if (!(flags & (kHasEmission | kHasTransparency))) return 0;
    return flags & kLambertian ? lambertian : all;
}

bool has_program(const SceneView& scene, size_t closure) {
    const TextureView& t = scene.textures;
    const auto programs = {t.closure_program, t.closure_weight_program, t.closure_normal_program};
    return std::any_of(programs.begin(), programs.end(),
                       [closure](const int32_t* program) { return program && program[closure] >= 0; });
}

}  // namespace

ShadingRules::ShadingRules(const SceneView& scene, const SceneTables& tables, int max_depth)
    : scene_(scene), tables_(tables), max_depth_(max_depth) {}

Reason ShadingRules::constant(const FloatSpans& requested) {
    if (requested.empty()) return Reason::kUnread;
    if (looks_the_same(requested)) return Reason::kLooksTheSame;
    if (only_outlines_move(requested)) return Reason::kOnlyOutlineMoves;
    return constant_by_kind(requested);
}

// A flat Lambertian convex body alone in a constant environment looks the same from everywhere, however it
// moves and turns.
bool ShadingRules::looks_the_same(const FloatSpans& requested) const {
    return scene_.convex && scene_.lights.count == 0 && !scene_.environment_image.pixels &&
           !scene_.textures.closure_program && requested.only({kVertices, kCamera, kInstances});
}

// Black meshes whose light has a fixed direction on all surfaces (shading/lights/fixed_direction_light.h)
// change nothing inside of their outlines. Behind mirrors and smooth glass, light has no fixed direction.
bool ShadingRules::only_outlines_move(const FloatSpans& requested) {
    if (!scene_.face_fixed_direction || !requests_vertices_alone(tables_, requested)) return false;
    if (!known(fixed_light_, [&] { return surfaces_have_fixed_light(); })) return false;
    const std::vector<uint8_t>& black = materials().black;
    return !any_moving_mesh(tables_, requested, [&](size_t mesh) {
        if (mesh >= static_cast<size_t>(tables_.visible_meshes)) return false;
        for (int32_t face = tables_.mesh_first_face[mesh]; face < tables_.mesh_first_face[mesh + 1]; ++face) {
            const bool fixed = scene_.face_fixed_direction[face] || scene_.lights.face_light[face] < 0;
            if (!(fixed && black[static_cast<size_t>(scene_.face_material[face])])) return true;
        }
        return false;
    });
}

// Whether light has a fixed direction on all visible surfaces that scatter it.
bool ShadingRules::surfaces_have_fixed_light() {
    if (may_be_specular(tables_, scene_.followed_alpha)) return false;
    const std::vector<uint8_t>& black = materials().black;
    const int32_t faces = tables_.mesh_first_face[static_cast<size_t>(tables_.visible_meshes)];
    return std::none_of(scene_.face_material, scene_.face_material + faces, [&](int32_t m) {
        return !scene_.material_fixed_direction[m] && !black[static_cast<size_t>(m)];
    });
}

const ShadingRules::Materials& ShadingRules::materials() {
    return known(materials_, [&] { return find_materials(); });
}

ShadingRules::Materials ShadingRules::find_materials() const {
    Materials out;
    out.black.resize(tables_.material_first_closure.size() - 1);
    for (size_t m = 0; m < out.black.size(); ++m) out.black[m] = is_black(scene_, static_cast<int32_t>(m));
    const bool lit = max_depth_ >= 2 && std::find(out.black.begin(), out.black.end(), 0) != out.black.end();
    // Layers transmit a part of the emission that depends on the direction.
    const auto matters = [&](size_t closure) {
        const int32_t flags = scene_.closure_flags[closure];
        return (flags & kHasTransparency) || has_program(scene_, closure) ||
               ((flags & kHasEmission) && (lit || !(flags & kLambertian)));
    };
    out.stays.resize(out.black.size());
    for (size_t m = 0; m < out.stays.size(); ++m)
        out.stays[m] = (!lit || out.black[m]) && !any_closure(scene_, m, matters);
    return out;
}

ShadingRules::Sources ShadingRules::find_sources() const {
    std::vector<FloatSpan> all, seen;
    for (size_t m = 0; m < tables_.material_used.size(); ++m) {
        if (!tables_.material_used[m]) continue;
        for (int32_t k = scene_.material_first_closure[m]; k < scene_.material_first_closure[m + 1]; ++k) {
            const auto closure = static_cast<size_t>(k);
            visit_sources(scene_, closure, Requested::columns(0, kMaterialParams),
                          [&](const FloatSpan& s) { all.push_back(s); });
            visit_sources(scene_, closure, directly_seen_columns(scene_, closure),
                          [&](const FloatSpan& s) { seen.push_back(s); });
        }
    }
    unite(all), unite(seen);
    const FloatSpans of_all(tables_, all), of_seen(tables_, seen);
    return {std::move(all), std::move(seen), of_all, of_seen};
}

// Each of the following returns why the requested values of its kind change no shading, kNeeded if they may,
// and kUnread if none is requested.

// Motion of meshes that scatter no light, and emit none that other surfaces scatter. Then only their outlines
// change the picture.
Reason ShadingRules::constant_by_motion(const FloatSpans& requested) {
    if (!requested.any(kVertices) && !requested.any(kInstances) && !requested.moves_fields())
        return Reason::kUnread;
    const std::vector<uint8_t>& stays = materials().stays;
    mesh_changes_.resize(tables_.mesh_first_face.size() - 1, -1);
    const auto changes = [&](size_t mesh) {
        int8_t& changed = mesh_changes_[mesh];
        const int32_t* faces = scene_.face_material;
        if (changed < 0)
            changed =
                std::any_of(faces + tables_.mesh_first_face[mesh], faces + tables_.mesh_first_face[mesh + 1],
                            [&](int32_t m) { return !stays[static_cast<size_t>(m)]; });
        return changed != 0;
    };
    const auto first_field = static_cast<size_t>(tables_.first_field());
    const auto field_changes = [&](size_t field) { return changes(first_field + field); };
    if (any_moving_mesh(tables_, requested, changes) || any_mesh_of_instances(tables_, requested, changes) ||
        any_moving_field(tables_, requested, field_changes))
        return Reason::kNeeded;
    return max_depth_ < 2 ? Reason::kNotRendered : Reason::kUnshaded;
}

// Values of closures, and textures that compute such.
Reason ShadingRules::constant_by_values(const FloatSpans& requested) {
    const auto tables = {kClosures, kTexturePixels, kTextureAttributes, kTextureLookups, kTextureConstants};
    if (std::none_of(tables.begin(), tables.end(), [&](FloatTable table) { return requested.any(table); }))
        return Reason::kUnread;
    const Sources& sources = known(sources_, [&] { return find_sources(); });
    const auto read = [&](const FloatSpans& by) {
        const auto meets = [&](const FloatSpan& s) { return by.any(s.table, s.first, s.last); };
        return std::any_of(requested.all().begin(), requested.all().end(), meets);
    };
    if (read(max_depth_ >= 2 ? sources.all : sources.seen)) return Reason::kNeeded;
    return read(sources.all) ? Reason::kNotRendered : Reason::kUnused;
}

// Lights of the table.
Reason ShadingRules::constant_by_lights(const FloatSpans& requested) {
    if (!requested.any(kLights)) return Reason::kUnread;
    const SceneTables::LightRows& rows = tables_.lights;
    for (const FloatSpan& s : requested.of(kLights))
        for (size_t row = s.first / kLightParams; row < rows.kind.size() && row * kLightParams < s.last;
             ++row)
            if (is_sized(rows.kind[row]) && (rows.visible_to[row] & (1 << kCameraRay)))
                return Reason::kNeeded;
    if (max_depth_ < 2) return Reason::kNotRendered;
    return known(all_black_, [&] { return all_black(scene_, tables_); }) ? Reason::kBlack : Reason::kNeeded;
}

// Where nothing else is requested.
Reason ShadingRules::constant_by_kind(const FloatSpans& requested) {
    if (!requested.only({kVertices, kNormals, kInstances, kFieldValues, kFieldPlaces, kClosures,
                         kTexturePixels, kTextureAttributes, kTextureLookups, kTextureConstants, kLights}) ||
        requests_custom_normals(tables_, requested))
        return Reason::kNeeded;
    Reason why = Reason::kUnread;
    for (const auto rule : {&ShadingRules::constant_by_motion, &ShadingRules::constant_by_values,
                            &ShadingRules::constant_by_lights}) {
        const Reason found = (this->*rule)(requested);
        if (found == Reason::kNeeded) return found;
        if (why == Reason::kUnread) why = found;
    }
    return why;
}

bool moves_anything(const SceneTables& tables, const FloatSpans& requested) {
    const auto any = [](size_t) { return true; };
    return any_moving_mesh(tables, requested, any) || requested.any(kInstances) ||
           any_moving_field(tables, requested, any) || moves_rays(tables.camera, requested) ||
           requested.moves_lights() || requested.any(kEnvironmentRotation);
}

}  // namespace edgegrad
