#include "engine/interior_rules.h"

#include <algorithm>

#include "scene/sharp_lobes.h"
#include "shading/bsdf/lobe.h"

namespace edgegrad {
namespace {

bool asks_only(const Wanted& wanted, const std::vector<const char*>& names) {
    const auto& spans = wanted.spans();
    return std::all_of(spans.begin(), spans.end(), [&](const auto& span) {
        return std::find(names.begin(), names.end(), span.first) != names.end();
    });
}

// A flat Lambertian convex body alone under a constant sky looks the same from everywhere, however it moves
// and turns.
bool looks_the_same(const SceneView& scene, const Wanted& wanted) {
    return scene.convex && scene.lights.count == 0 && !scene.sky.pixels && !scene.textures.leaf_program &&
           asks_only(wanted, {"vertices", "camera", "instance_to_world"});
}

// Where nothing but how wide lobes of shaders are is asked for: these lobes (bits).
int32_t lobes_alone(const Wanted& wanted) {
    if (wanted.spans().size() != 1 || !wanted.any("leaf_params")) return 0;
    constexpr uint64_t rough = Wanted::columns(kRoughness, kRoughness + 1),
                       coat = Wanted::columns(kCoatRoughness, kCoatRoughness + 1);
    const uint64_t columns = wanted.span("leaf_params").columns;
    if ((columns & ~(rough | coat)) != 0) return 0;
    return ((columns & rough) ? 1 << kMirrorLobe | 1 << kInterfaceLobe : 0) |
           ((columns & coat) ? 1 << kCoatLobe : 0);
}

bool is_black(const SceneView& scene, int32_t material) {
    for (int32_t leaf = scene.material_first_leaf[material]; leaf < scene.material_first_leaf[material + 1];
         ++leaf) {
        const float* color = scene.leaf_params + static_cast<ptrdiff_t>(leaf) * kMaterialParams + kBaseColor;
        if (!(scene.leaf_flags[leaf] & kLambertian) || color[0] > 0.0f || color[1] > 0.0f ||
            color[2] > 0.0f || (scene.textures.leaf_program && scene.textures.leaf_program[leaf] >= 0))
            return false;
    }
    return true;
}

// Black meshes whose light holds its direction on all surfaces (shading/lights/fixed_direction_light.h)
// change nothing inside of their outlines. Behind mirrors and smooth glass it doesn't.
bool only_outlines_move(const SceneView& scene, const SceneTables& tables, const Wanted& wanted) {
    if (!scene.face_held || !asks_only(wanted, {"vertices", "normals"}) ||
        may_be_specular(tables, scene.followed_alpha))
        return false;
    std::vector<uint8_t> rides(tables.material_first_leaf.size() - 1);
    for (size_t m = 0; m < rides.size(); ++m) {
        const auto material = static_cast<int32_t>(m);
        rides[m] = !scene.material_held[m] && !is_black(scene, material);
    }
    for (int32_t mesh = 0; mesh < tables.visible_meshes; ++mesh) {
        const auto m = static_cast<size_t>(mesh);
        const bool moves = wanted.moving()[m] != 0;
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
bool nothing_shaded_moves(const SceneView& scene, const SceneTables& tables, const Wanted& wanted,
                          int max_depth) {
    if (!asks_only(wanted, {"vertices", "normals"})) return false;
    std::vector<uint8_t> black(tables.material_first_leaf.size() - 1);
    for (size_t m = 0; m < black.size(); ++m) black[m] = is_black(scene, static_cast<int32_t>(m));
    const bool lit = max_depth >= 2 && std::find(black.begin(), black.end(), 0) != black.end();
    // Of a moving shader: that lets light pass, differs from place to place, or lights others.
    const auto matters = [&](int32_t leaf) {
        return (scene.leaf_flags[leaf] & (kHasTransparency | (lit ? kHasEmission : 0))) ||
               (scene.textures.leaf_program && scene.textures.leaf_program[leaf] >= 0);
    };
    std::vector<uint8_t> stays(black.size());
    for (size_t m = 0; m < stays.size(); ++m) {
        stays[m] = !lit || black[m];
        for (int32_t leaf = scene.material_first_leaf[m]; leaf < scene.material_first_leaf[m + 1]; ++leaf)
            stays[m] &= !matters(leaf);
    }
    for (size_t mesh = 0; mesh < wanted.moving().size(); ++mesh) {
        if (!wanted.moving()[mesh]) continue;
        for (int32_t face = tables.mesh_first_face[mesh]; face < tables.mesh_first_face[mesh + 1]; ++face)
            if (!stays[static_cast<size_t>(scene.face_material[face])]) return false;
    }
    return true;
}

// Whether a mesh that moves gives light.
bool moving_meshes_glow(const SceneView& scene, const SceneTables& tables, const Wanted& wanted) {
    if (!(scene.all_flags & kHasEmission)) return false;
    std::vector<uint8_t> glows(tables.material_first_leaf.size() - 1, 0);
    for (size_t m = 0; m < glows.size(); ++m)
        for (int32_t leaf = scene.material_first_leaf[m]; leaf < scene.material_first_leaf[m + 1]; ++leaf)
            glows[m] |= (scene.leaf_flags[leaf] & kHasEmission) != 0;
    for (size_t mesh = 0; mesh < wanted.moving().size(); ++mesh)
        for (int32_t face = tables.mesh_first_face[mesh];
             wanted.moving()[mesh] && face < tables.mesh_first_face[mesh + 1]; ++face)
            if (glows[static_cast<size_t>(scene.face_material[face])]) return true;
    return false;
}

}  // namespace

bool shading_is_constant(const SceneView& scene, const SceneTables& tables, const Wanted& wanted,
                         int max_depth) {
    return looks_the_same(scene, wanted) || only_outlines_move(scene, tables, wanted) ||
           nothing_shaded_moves(scene, tables, wanted, max_depth);
}

bool rims_move(const SceneView& scene, const SceneTables& tables, const Wanted& wanted) {
    const bool textures = wanted.any("texture_pixels") || wanted.any("texture_attributes") ||
                          wanted.any("texture_lookups") || wanted.any("texture_constants");
    for (size_t leaf = 0; leaf < tables.leaf_flags.size(); ++leaf) {
        if (!may_refract_roughly(tables, leaf)) continue;
        if (wanted.geometry()) return true;
        // Of a shader's values, its index and what bends its normals.
        const auto asks = [&](size_t first, size_t last) {
            return wanted.any("leaf_params", leaf * kMaterialParams + first, leaf * kMaterialParams + last);
        };
        if (asks(kIor, kIor + 1) || asks(kNormalMap, kNormalStrength + 1)) return true;
        if (textures && scene.textures.leaf_program && scene.textures.leaf_program[leaf] >= 0) return true;
    }
    return false;
}

AskedSurfaces asked_surfaces(const SceneView& scene, const SceneTables& tables, const Wanted& wanted,
                             const std::vector<int32_t>& passed) {
    AskedSurfaces out;
    const Wanted::Span span = wanted.span("leaf_params");
    out.first_leaf = static_cast<int32_t>(span.first / kMaterialParams);
    out.last_leaf = static_cast<int32_t>(span.last / kMaterialParams);
    out.lobes = lobes_alone(wanted);
    out.moving = wanted.any("vertices");
    // Normals that don't follow vertices may be those of any mesh.
    out.everywhere = wanted.spans().empty() || !asks_only(wanted, {"leaf_params", "vertices", "normals"}) ||
                     wanted.any("normals", 0, tables.normals.size()) || !passed.empty();
    for (int32_t leaf = out.first_leaf; leaf < out.last_leaf; ++leaf)
        out.everywhere |= (scene.leaf_flags[leaf] & kHasEmission) != 0;
    // What passes through a surface is part of the light that the vertex before it scatters.
    if (out.moving && !out.everywhere)
        out.everywhere = (scene.all_flags & kHasTransparency) || moving_meshes_glow(scene, tables, wanted);
    return out;
}

}  // namespace edgegrad
