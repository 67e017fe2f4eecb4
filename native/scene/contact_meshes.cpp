#include "scene/contact_meshes.h"

#include <algorithm>

#include "scene/closure_programs.h"
#include "scene/face_vectors.h"
#include "scene/sharp_lobes.h"

namespace edgegrad {
namespace {

// Returns whether a closure's textures may jump within a face.
bool jumps(const SceneTables& tables, size_t closure) {
    const TextureTables& t = tables.textures;
    return any_step(tables, closure, [&t](const TextureInstruction& step) {
        switch (static_cast<TextureOp>(step.op)) {
            case TextureOp::IMAGE:
                return t.images[static_cast<size_t>(step.data)].interpolation == kImageClosest;
            case TextureOp::LOOKUP:
                return t.tables[static_cast<size_t>(step.data)].interpolate == 0;
            case TextureOp::LESS_THAN:
            case TextureOp::GREATER_THAN:
            case TextureOp::EQUAL:
            case TextureOp::SELECT:
            case TextureOp::SIGN:
            case TextureOp::FLOOR:
            case TextureOp::CEIL:
            case TextureOp::MODULO:
            case TextureOp::ARCTAN2:
            case TextureOp::RGB_TO_HSV:
            case TextureOp::RGB_TO_HSL:
            case TextureOp::CHECKER:
            case TextureOp::BRICK:
            case TextureOp::WHITE_NOISE:
            case TextureOp::VORONOI:
                return true;
            default:
                return false;
        }
    });
}

int32_t flags_of(const SceneTables& tables, size_t material) {
    int32_t flags = kContactFrom | kContactTo;
    const auto first = static_cast<size_t>(tables.material_first_closure[material]),
               last = static_cast<size_t>(tables.material_first_closure[material + 1]);
    for (size_t closure = first; closure < last; ++closure) {
        if (jumps(tables, closure)) flags &= ~kContactTo;
        if (tables.closure_flags[closure] & kHasNormalMap) flags |= kContactBent;
        if (may_be_specular(tables, closure)) return 0;
    }
    return flags;
}

// Returns whether the normals of a face's corners equal its own.
bool is_flat(const SceneTables& tables, size_t face) {
    if (!is_smooth(tables, face)) return true;
    const int32_t* corners = &tables.corner_normal[3 * face];
    const Vector m = area_normal(tables, face);
    return std::all_of(corners, corners + 3, [&](int32_t c) {
        const float* p = &tables.normals[3 * static_cast<size_t>(c)];
        const Vector n{p[0], p[1], p[2]}, lean = cross(n, m);
        return dot(lean, lean) <= 1e-12 * dot(n, n) * dot(m, m);
    });
}

}  // namespace

std::vector<int32_t> contact_meshes(const SceneTables& tables, const SceneView& view,
                                    const RequestedMotion& motion) {
    const bool moves = motion.camera || motion.any_mesh_moves();
    if (!moves || view.face_held || (view.all_flags & kHasTransparency)) return {};
    std::vector<int32_t> materials(tables.material_first_closure.size() - 1);
    for (size_t m = 0; m < materials.size(); ++m) materials[m] = flags_of(tables, m);
    // Some lights turn with their receivers. At horizons these are in material form
    // (boundary/terms/horizon.h).
    const bool turning = view.lights.kinds & kTurningLights;
    std::vector<int32_t> meshes(static_cast<size_t>(tables.visible_meshes), 0);
    int32_t any = 0;
    for (size_t mesh = 0; mesh < meshes.size(); ++mesh) {
        const auto first = static_cast<size_t>(tables.mesh_first_face[mesh]),
                   last = static_cast<size_t>(tables.mesh_first_face[mesh + 1]);
        int32_t flags = first < last ? kContactFrom | kContactTo : 0;
        bool bent = false;
        for (size_t face = first; face < last && flags; ++face) {
            const int32_t material = materials[static_cast<size_t>(tables.face_material[face])];
            bent = bent || (material & kContactBent) || !is_flat(tables, face);
            flags &= material;
        }
        if (bent) flags = turning ? 0 : flags | kContactBent;
        meshes[mesh] = flags;
        any |= flags;
    }
    return (any & kContactFrom) && (any & kContactTo) ? meshes : std::vector<int32_t>{};
}

}  // namespace edgegrad
