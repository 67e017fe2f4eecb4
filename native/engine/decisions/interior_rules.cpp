#include "engine/decisions/interior_rules.h"

#include <algorithm>

#include "scene/sharp_lobes.h"
#include "shading/bsdf/lobe.h"

namespace edgegrad {

bool is_black(const SceneView& scene, int32_t material) {
    for (int32_t closure = scene.material_first_closure[material];
         closure < scene.material_first_closure[material + 1]; ++closure) {
        const float* color =
            scene.closure_params + static_cast<ptrdiff_t>(closure) * kMaterialParams + kBaseColor;
        if (!(scene.closure_flags[closure] & kLambertian) || color[0] > 0.0f || color[1] > 0.0f ||
            color[2] > 0.0f ||
            (scene.textures.closure_program && scene.textures.closure_program[closure] >= 0))
            return false;
    }
    return true;
}

namespace {

bool requests_only(const Requested& requested, const std::vector<const char*>& names) {
    const auto& spans = requested.spans();
    return std::all_of(spans.begin(), spans.end(), [&](const auto& span) {
        return std::find(names.begin(), names.end(), span.first) != names.end();
    });
}

// Whether nothing but vertices is requested, and the shading normals that follow them. Others change shading
// where no vertex moves.
bool requests_vertices_alone(const SceneTables& tables, const Requested& requested) {
    return requests_only(requested, {"vertices", "normals"}) &&
           !requested.any("normals", 0, tables.normals.size());
}

// A flat Lambertian convex body alone in a constant environment looks the same from everywhere, however it
// moves and turns.
bool looks_the_same(const SceneView& scene, const Requested& requested) {
    return scene.convex && scene.lights.count == 0 && !scene.sky.pixels && !scene.textures.closure_program &&
           requests_only(requested, {"vertices", "camera", "instance_to_world"});
}

// Where nothing but how wide lobes of shaders are is asked for: these lobes (bits).
int32_t lobes_alone(const Requested& requested) {
    if (requested.spans().size() != 1 || !requested.any("closure_params")) return 0;
    constexpr uint64_t rough = Requested::columns(kRoughness, kRoughness + 1),
                       coat = Requested::columns(kCoatRoughness, kCoatRoughness + 1);
    const uint64_t columns = requested.span("closure_params").columns;
    if ((columns & ~(rough | coat)) != 0) return 0;
    return ((columns & rough) ? 1 << kMirrorLobe | 1 << kInterfaceLobe : 0) |
           ((columns & coat) ? 1 << kCoatLobe : 0);
}

// Black meshes whose light holds its direction on all surfaces (shading/lights/fixed_direction_light.h)
// change nothing inside of their outlines. Behind mirrors and smooth glass it doesn't.
bool only_outlines_move(const SceneView& scene, const SceneTables& tables, const Requested& requested) {
    if (!scene.face_held || !requests_vertices_alone(tables, requested) ||
        may_be_specular(tables, scene.followed_alpha))
        return false;
    std::vector<uint8_t> rides(tables.material_first_closure.size() - 1);
    for (size_t m = 0; m < rides.size(); ++m) {
        const auto material = static_cast<int32_t>(m);
        rides[m] = !scene.material_held[m] && !is_black(scene, material);
    }
    for (int32_t mesh = 0; mesh < tables.visible_meshes; ++mesh) {
        const auto m = static_cast<size_t>(mesh);
        const bool moves = requested.moving()[m] != 0;
        for (int32_t face = tables.mesh_first_face[m]; face < tables.mesh_first_face[m + 1]; ++face) {
            const int32_t material = scene.face_material[face];
            if (rides[static_cast<size_t>(material)]) return false;
            const bool rests = scene.face_held[face] || scene.lights.face_light[face] < 0;
            if (moves && !(rests && is_black(scene, material))) return false;
        }
    }
    return true;
}

// What moves is black and gives no light, or all is black, as where only light seen directly is rendered. Its
// outlines alone then change the picture.
bool nothing_shaded_moves(const SceneView& scene, const SceneTables& tables, const Requested& requested,
                          int max_depth) {
    if (!requests_vertices_alone(tables, requested)) return false;
    std::vector<uint8_t> black(tables.material_first_closure.size() - 1);
    for (size_t m = 0; m < black.size(); ++m) black[m] = is_black(scene, static_cast<int32_t>(m));
    const bool lit = max_depth >= 2 && std::find(black.begin(), black.end(), 0) != black.end();
    // Of a moving shader: that lets light pass, differs from place to place, or lights others.
    const auto matters = [&](int32_t closure) {
        return (scene.closure_flags[closure] & (kHasTransparency | (lit ? kHasEmission : 0))) ||
               (scene.textures.closure_program && scene.textures.closure_program[closure] >= 0);
    };
    std::vector<uint8_t> stays(black.size());
    for (size_t m = 0; m < stays.size(); ++m) {
        stays[m] = !lit || black[m];
        for (int32_t closure = scene.material_first_closure[m]; closure < scene.material_first_closure[m + 1];
             ++closure)
            stays[m] &= !matters(closure);
    }
    for (size_t mesh = 0; mesh < requested.moving().size(); ++mesh) {
        if (!requested.moving()[mesh]) continue;
        for (int32_t face = tables.mesh_first_face[mesh]; face < tables.mesh_first_face[mesh + 1]; ++face)
            if (!stays[static_cast<size_t>(scene.face_material[face])]) return false;
    }
    return true;
}

// Whether a mesh that moves gives light.
bool moving_meshes_glow(const SceneView& scene, const SceneTables& tables, const Requested& requested) {
    if (!(scene.all_flags & kHasEmission)) return false;
    std::vector<uint8_t> glows(tables.material_first_closure.size() - 1, 0);
    for (size_t m = 0; m < glows.size(); ++m)
        for (int32_t closure = scene.material_first_closure[m]; closure < scene.material_first_closure[m + 1];
             ++closure)
            glows[m] |= (scene.closure_flags[closure] & kHasEmission) != 0;
    for (size_t mesh = 0; mesh < requested.moving().size(); ++mesh)
        for (int32_t face = tables.mesh_first_face[mesh];
             requested.moving()[mesh] && face < tables.mesh_first_face[mesh + 1]; ++face)
            if (glows[static_cast<size_t>(scene.face_material[face])]) return true;
    return false;
}

}  // namespace

Reason constant_shading(const SceneView& scene, const SceneTables& tables, const Requested& requested,
                        int max_depth) {
    if (looks_the_same(scene, requested)) return Reason::kLooksTheSame;
    if (only_outlines_move(scene, tables, requested)) return Reason::kOnlyOutlineMoves;
    return nothing_shaded_moves(scene, tables, requested, max_depth) ? Reason::kUnshaded : Reason::kNeeded;
}

bool all_black(const SceneView& scene, const SceneTables& tables) {
    if (scene.all_flags & kHasTransparency) return false;  // surfaces behind show what those let through
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
    const bool textures = requested.any("texture_pixels") || requested.any("texture_attributes") ||
                          requested.any("texture_lookups") || requested.any("texture_constants");
    for (size_t closure = 0; closure < tables.closure_flags.size(); ++closure) {
        if (!may_refract_roughly(tables, closure)) continue;
        if (requested.geometry()) return true;
        // Of a shader's values, its index and what bends its normals.
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

RequestedSurfaces requested_surfaces(const SceneView& scene, const SceneTables& tables,
                                     const Requested& requested, const std::vector<int32_t>& passed) {
    RequestedSurfaces out;
    const Requested::Span span = requested.span("closure_params");
    out.first_closure = static_cast<int32_t>(span.first / kMaterialParams);
    out.last_closure = static_cast<int32_t>(span.last / kMaterialParams);
    out.lobes = lobes_alone(requested);
    out.moving = requested.any("vertices");
    // Normals that don't follow vertices may be those of any mesh.
    out.everywhere = requested.spans().empty() ||
                     !requests_only(requested, {"closure_params", "vertices", "normals"}) ||
                     requested.any("normals", 0, tables.normals.size()) || !passed.empty();
    for (int32_t closure = out.first_closure; closure < out.last_closure; ++closure)
        out.everywhere |= (scene.closure_flags[closure] & kHasEmission) != 0;
    // What passes through a surface is part of the light that the vertex before it scatters.
    if (out.moving && !out.everywhere)
        out.everywhere = (scene.all_flags & kHasTransparency) || moving_meshes_glow(scene, tables, requested);
    return out;
}

}  // namespace edgegrad
