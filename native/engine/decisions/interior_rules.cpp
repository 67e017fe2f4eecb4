#include "engine/decisions/interior_rules.h"

#include <algorithm>
#include <iterator>

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

// If only roughness is requested: bits of the lobes that it shapes; otherwise 0.
int32_t lobes_alone(const Requested& requested) {
    if (requested.spans().size() != 1 || !requested.any(FloatTable::kClosures)) return 0;
    constexpr uint64_t rough = Requested::columns(kRoughness, kRoughness + 1),
                       coat = Requested::columns(kCoatRoughness, kCoatRoughness + 1);
    const uint64_t columns = requested.span(FloatTable::kClosures).columns;
    if ((columns & ~(rough | coat)) != 0) return 0;
    return ((columns & rough) ? 1 << kMirrorLobe | 1 << kInterfaceLobe : 0) |
           ((columns & coat) ? 1 << kCoatLobe : 0);
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
            return requested.any(FloatTable::kClosures, closure * kMaterialParams + first,
                                 closure * kMaterialParams + last);
        };
        if (is_requested(kIor, kIor + 1) || is_requested(kNormalMap, kNormalStrength + 1)) return true;
        if (textures && scene.textures.closure_program && scene.textures.closure_program[closure] >= 0)
            return true;
    }
    return false;
}

Rims rims_that_count(const SceneView& scene, const SceneTables& tables) {
    const bool blurs = scene.least_alpha > 0.0f, sized = scene.lights.all_sized() > 0;
    const auto is_used = [&](const auto& is) { return !used_materials(tables, is).empty(); };
    if (is_used([&](size_t closure) { return may_have_lobe_rim(tables, closure, blurs); })) return Rims::kAll;
    // For lights without size the rims of gloss are lines
    const bool gloss = sized && is_used([&](size_t closure) { return may_have_gloss_rim(tables, closure); });
    return gloss ? Rims::kOfGloss : Rims::kNone;
}

bool changes_densities(const Requested& requested) {
    constexpr uint64_t even =
        Requested::columns(kBaseColor, kBaseColor + 3) | Requested::columns(kEmission, kEmission + 3);
    return requested.any(FloatTable::kEnvironmentPixels) || requested.any(FloatTable::kLights) ||
           requested.textures() || (requested.span(FloatTable::kClosures).columns & ~even) != 0;
}

bool shapes_lobes(const Requested& requested, size_t closure) {
    const auto is_requested = [&](size_t first, size_t last) {
        return requested.any(FloatTable::kClosures, closure * kMaterialParams + first,
                             closure * kMaterialParams + last);
    };
    return is_requested(kRoughness, kRoughness + 1) || is_requested(kIor, kAnisotropyRotation + 1) ||
           is_requested(kCoatRoughness, kCoatRoughness + 1) || is_requested(kNormalMap, kNormalStrength + 1);
}

RequestedSurfaces requested_surfaces(const SceneView& scene, const SceneTables& tables,
                                     const Requested& requested, const std::vector<int32_t>& passed) {
    RequestedSurfaces out;
    const Requested::Span span = requested.span(FloatTable::kClosures);
    out.first_closure = static_cast<int32_t>(span.first / kMaterialParams);
    out.last_closure = static_cast<int32_t>(span.last / kMaterialParams);
    out.lobes = lobes_alone(requested);
    out.moving = requested.any(FloatTable::kVertices) || requested.moves_fields();
    // Custom normals may belong to any mesh.
    out.everywhere =
        requested.spans().empty() ||
        !requested.floats().only({FloatTable::kClosures, FloatTable::kVertices, FloatTable::kNormals,
                                  FloatTable::kFieldValues, FloatTable::kFieldPlaces}) ||
        requested.any(FloatTable::kNormals, 0, tables.normals.size()) || !passed.empty();
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
