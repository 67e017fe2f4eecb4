#include "engine/decisions/interior_rules.h"

#include <algorithm>
#include <iterator>

#include "engine/decisions/value_sources.h"
#include "scene/lights/light_params.h"
#include "scene/sharp_lobes.h"
#include "shading/bsdf/lobe.h"

namespace edgegrad {

bool is_black(const SceneView& scene, int32_t material) {
    return !any_closure(scene, static_cast<size_t>(material), [&](size_t closure) {
        const float* color = scene.closure_params + closure * kMaterialParams + kBaseColor;
        return !(scene.closure_flags[closure] & kLambertian) || color[0] > 0.0f || color[1] > 0.0f ||
               color[2] > 0.0f ||
               (scene.textures.closure_program && scene.textures.closure_program[closure] >= 0);
    });
}

namespace {

bool requests_only(const Requested& requested, const std::vector<const char*>& names) {
    const auto& spans = requested.spans();
    return std::all_of(spans.begin(), spans.end(), [&](const auto& span) {
        return std::find(names.begin(), names.end(), span.first) != names.end();
    });
}

// Whether only vertices are requested, with the shading normals that depend on them. Custom normals change
// shading without any motion.
bool requests_vertices_alone(const SceneTables& tables, const Requested& requested) {
    return requests_only(requested, {"vertices", "normals"}) &&
           !requested.any("normals", 0, tables.normals.size());
}

// A flat Lambertian convex body alone in a constant environment looks the same from everywhere, however it
// moves and turns.
bool looks_the_same(const SceneView& scene, const Requested& requested) {
    return scene.convex && scene.lights.count == 0 && !scene.environment_image.pixels &&
           !scene.textures.closure_program &&
           requests_only(requested, {"vertices", "camera", "instance_to_world"});
}

// If only roughness is requested: bits of the lobes that it shapes; otherwise 0.
int32_t lobes_alone(const Requested& requested) {
    if (requested.spans().size() != 1 || !requested.any("closure_params")) return 0;
    constexpr uint64_t rough = Requested::columns(kRoughness, kRoughness + 1),
                       coat = Requested::columns(kCoatRoughness, kCoatRoughness + 1);
    const uint64_t columns = requested.span("closure_params").columns;
    if ((columns & ~(rough | coat)) != 0) return 0;
    return ((columns & rough) ? 1 << kMirrorLobe | 1 << kInterfaceLobe : 0) |
           ((columns & coat) ? 1 << kCoatLobe : 0);
}

// Black meshes whose light has a fixed direction on all surfaces (shading/lights/fixed_direction_light.h)
// change nothing inside of their outlines. Behind mirrors and smooth glass, light has no fixed direction.
bool only_outlines_move(const SceneView& scene, const SceneTables& tables, const Requested& requested) {
    if (!scene.face_fixed_direction || !requests_vertices_alone(tables, requested) ||
        may_be_specular(tables, scene.followed_alpha))
        return false;
    std::vector<uint8_t> material_form(tables.material_first_closure.size() - 1);
    for (size_t m = 0; m < material_form.size(); ++m) {
        const auto material = static_cast<int32_t>(m);
        material_form[m] = !scene.material_fixed_direction[m] && !is_black(scene, material);
    }
    for (int32_t mesh = 0; mesh < tables.visible_meshes; ++mesh) {
        const auto m = static_cast<size_t>(mesh);
        const bool moves = requested.moving()[m] != 0;
        for (int32_t face = tables.mesh_first_face[m]; face < tables.mesh_first_face[m + 1]; ++face) {
            const int32_t material = scene.face_material[face];
            if (material_form[static_cast<size_t>(material)]) return false;
            const bool fixed = scene.face_fixed_direction[face] || scene.lights.face_light[face] < 0;
            if (moves && !(fixed && is_black(scene, material))) return false;
        }
    }
    return true;
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

// By mesh, whether its vertices, some of its instances or its field are requested.
std::vector<uint8_t> requested_meshes(const SceneTables& tables, const Requested& requested) {
    std::vector<uint8_t> out = requested.moving();
    for (size_t k = 0; requested.any("instance_to_world") && k < tables.instance_mesh.size(); ++k)
        out[static_cast<size_t>(tables.instance_mesh[k])] |=
            requested.any("instance_to_world", 12 * k, 12 * k + 12);
    for (size_t k = 0; k < requested.moving_fields().size(); ++k)
        out[static_cast<size_t>(tables.first_field()) + k] |= requested.moving_fields()[k];
    return out;
}

// Each of the following returns why the requested values of its kind change no shading, kNeeded if they may,
// and kUnread if none is requested.

// Motion of meshes that scatter no light, and emit none that other surfaces scatter. Then only their outlines
// change the picture.
Reason constant_by_motion(const SceneView& scene, const SceneTables& tables, const Requested& requested,
                          int max_depth) {
    if (!requested.any("vertices") && !requested.any("instance_to_world") && !requested.moves_fields())
        return Reason::kUnread;
    std::vector<uint8_t> black(tables.material_first_closure.size() - 1);
    for (size_t m = 0; m < black.size(); ++m) black[m] = is_black(scene, static_cast<int32_t>(m));
    const bool lit = max_depth >= 2 && std::find(black.begin(), black.end(), 0) != black.end();
    // Layers transmit a part of the emission that depends on the direction.
    const auto matters = [&](size_t closure) {
        const int32_t flags = scene.closure_flags[closure];
        return (flags & kHasTransparency) || has_program(scene, closure) ||
               ((flags & kHasEmission) && (lit || !(flags & kLambertian)));
    };
    std::vector<uint8_t> stays(black.size());
    for (size_t m = 0; m < stays.size(); ++m)
        stays[m] = (!lit || black[m]) && !any_closure(scene, m, matters);
    const std::vector<uint8_t> moving = requested_meshes(tables, requested);
    for (size_t mesh = 0; mesh < moving.size(); ++mesh)
        for (int32_t face = tables.mesh_first_face[mesh];
             moving[mesh] && face < tables.mesh_first_face[mesh + 1]; ++face)
            if (!stays[static_cast<size_t>(scene.face_material[face])]) return Reason::kNeeded;
    return max_depth < 2 ? Reason::kNotRendered : Reason::kUnshaded;
}

// Values of closures, and textures that compute such.
Reason constant_by_values(const SceneView& scene, const SceneTables& tables, const Requested& requested,
                          int max_depth) {
    constexpr const char* names[] = {"closure_params", "texture_pixels", "texture_attributes",
                                     "texture_lookups", "texture_constants"};
    if (std::none_of(std::begin(names), std::end(names), [&](const char* t) { return requested.any(t); }))
        return Reason::kUnread;
    Reason why = Reason::kUnused;
    for (size_t m = 0; m < tables.material_used.size(); ++m) {
        if (!tables.material_used[m]) continue;
        for (int32_t k = scene.material_first_closure[m]; k < scene.material_first_closure[m + 1]; ++k) {
            const auto closure = static_cast<size_t>(k);
            if (!value_sources(scene, requested, closure, Requested::columns(0, kMaterialParams)).requested)
                continue;
            const uint64_t seen = directly_seen_columns(scene, closure);
            if (max_depth >= 2 || value_sources(scene, requested, closure, seen).requested)
                return Reason::kNeeded;
            why = Reason::kNotRendered;
        }
    }
    return why;
}

// Lights of the table.
Reason constant_by_lights(const SceneView& scene, const SceneTables& tables, const Requested& requested,
                          int max_depth) {
    if (!requested.any("light_params")) return Reason::kUnread;
    const SceneTables::LightRows& rows = tables.lights;
    for (size_t row = 0; row < rows.kind.size(); ++row)
        if (is_sized(rows.kind[row]) && (rows.visible_to[row] & (1 << kCameraRay)) &&
            requested.row_columns("light_params", row) != 0)
            return Reason::kNeeded;
    if (max_depth < 2) return Reason::kNotRendered;
    return all_black(scene, tables) ? Reason::kBlack : Reason::kNeeded;
}

// Where nothing else is requested.
Reason constant_by_kind(const SceneView& scene, const SceneTables& tables, const Requested& requested,
                        int max_depth) {
    if (!requests_only(requested, {"vertices", "normals", "instance_to_world", "field_values",
                                   "field_to_world", "closure_params", "texture_pixels", "texture_attributes",
                                   "texture_lookups", "texture_constants", "light_params"}) ||
        requested.any("normals", 0, tables.normals.size()))
        return Reason::kNeeded;
    Reason why = Reason::kUnread;
    for (const auto rule : {constant_by_motion, constant_by_values, constant_by_lights}) {
        const Reason found = rule(scene, tables, requested, max_depth);
        if (found == Reason::kNeeded) return found;
        if (why == Reason::kUnread) why = found;
    }
    return why;
}

// Whether a mesh that moves gives light.
bool moving_meshes_glow(const SceneView& scene, const SceneTables& tables, const Requested& requested) {
    if (!(scene.all_flags & kHasEmission)) return false;
    std::vector<uint8_t> glows(tables.material_first_closure.size() - 1);
    for (size_t m = 0; m < glows.size(); ++m) glows[m] = has_flags(scene, m, kHasEmission);
    for (size_t mesh = 0; mesh < requested.moving().size(); ++mesh)
        if (requested.moving()[mesh] && has_face_of(tables, mesh, glows)) return true;
    return false;
}

}  // namespace

Reason constant_shading(const SceneView& scene, const SceneTables& tables, const Requested& requested,
                        int max_depth) {
    if (requested.spans().empty()) return Reason::kUnread;
    if (looks_the_same(scene, requested)) return Reason::kLooksTheSame;
    if (only_outlines_move(scene, tables, requested)) return Reason::kOnlyOutlineMoves;
    return constant_by_kind(scene, tables, requested, max_depth);
}

bool all_black(const SceneView& scene, const SceneTables& tables) {
    if (scene.all_flags & kHasTransparency) return false;  // transmittance may change
    const int32_t faces = tables.mesh_first_face[static_cast<size_t>(tables.visible_meshes)];
    std::vector<int8_t> black(tables.material_first_closure.size() - 1, -1);
    for (int32_t face = 0; face < faces; ++face) {
        const int32_t material = scene.face_material[face];
        int8_t& known = black[static_cast<size_t>(material)];
        if (known < 0) known = is_black(scene, material);
        if (!known) return false;
    }
    return true;
}

bool rims_move(const SceneView& scene, const SceneTables& tables, const Requested& requested) {
    const bool textures = requested.textures();
    for (size_t closure = 0; closure < tables.closure_flags.size(); ++closure) {
        if (!may_have_rim(tables, closure, scene.least_alpha > 0.0f)) continue;
        if (requested.geometry()) return true;
        // Rims depend on the closure's index and normal map.
        const auto is_requested = [&](size_t first, size_t last) {
            return requested.any("closure_params", closure * kMaterialParams + first,
                                 closure * kMaterialParams + last);
        };
        if (is_requested(kIor, kIor + 1) || is_requested(kNormalMap, kNormalStrength + 1)) return true;
        if (textures && scene.textures.closure_program && scene.textures.closure_program[closure] >= 0)
            return true;
    }
    return false;
}

Rims rims_that_count(const SceneView& scene, const SceneTables& tables) {
    // For lights without size the rims of gloss are lines.
    Rims out = Rims::kNone;
    for (size_t closure = 0; closure < tables.closure_flags.size(); ++closure) {
        if (may_have_lobe_rim(tables, closure, scene.least_alpha > 0.0f)) return Rims::kAll;
        if (scene.lights.all_sized() > 0 && may_have_gloss_rim(tables, closure)) out = Rims::kOfGloss;
    }
    return out;
}

bool changes_densities(const Requested& requested) {
    constexpr uint64_t even =
        Requested::columns(kBaseColor, kBaseColor + 3) | Requested::columns(kEmission, kEmission + 3);
    return requested.any("environment_pixels") || requested.any("light_params") || requested.textures() ||
           (requested.span("closure_params").columns & ~even) != 0;
}

bool shapes_lobes(const Requested& requested, size_t closure) {
    const auto is_requested = [&](size_t first, size_t last) {
        return requested.any("closure_params", closure * kMaterialParams + first,
                             closure * kMaterialParams + last);
    };
    return is_requested(kRoughness, kRoughness + 1) || is_requested(kIor, kAnisotropyRotation + 1) ||
           is_requested(kCoatRoughness, kCoatRoughness + 1) || is_requested(kNormalMap, kNormalStrength + 1);
}

RequestedSurfaces requested_surfaces(const SceneView& scene, const SceneTables& tables,
                                     const Requested& requested, const std::vector<int32_t>& passed) {
    RequestedSurfaces out;
    const Requested::Span span = requested.span("closure_params");
    out.first_closure = static_cast<int32_t>(span.first / kMaterialParams);
    out.last_closure = static_cast<int32_t>(span.last / kMaterialParams);
    out.lobes = lobes_alone(requested);
    out.moving = requested.any("vertices") || requested.moves_fields();
    // Custom normals may belong to any mesh.
    out.everywhere = requested.spans().empty() ||
                     !requests_only(requested, {"closure_params", "vertices", "normals", "field_values",
                                                "field_to_world"}) ||
                     requested.any("normals", 0, tables.normals.size()) || !passed.empty();
    for (int32_t closure = out.first_closure; closure < out.last_closure; ++closure)
        out.everywhere |= (scene.closure_flags[closure] & kHasEmission) != 0;
    // Light that passes through a surface is scattered by the vertex before it.
    if (out.moving && !out.everywhere)
        out.everywhere = (scene.all_flags & kHasTransparency) || moving_meshes_glow(scene, tables, requested);
    out.even_light = out.moving && !out.everywhere && out.first_closure == out.last_closure &&
                     scene.has_environment && !scene.environment_image.pixels &&
                     !scene.textures.closure_program && !scene.textures.closure_weight_program &&
                     !(scene.all_flags & (kHasNormalMap | kHasAbsorption));
    return out;
}

}  // namespace edgegrad
