#include "passed_leaves.h"

#include <algorithm>
#include <array>

#include "shading/passed_surfaces.h"
#include "texture/opcodes.h"

namespace edgegrad {
namespace {

// Columns of a shader's row that its transparent share is made of.
uint64_t share_columns(const SceneView& scene, size_t leaf) {
    const bool clear = scene.leaf_kind[leaf] == kTransparent;
    return Wanted::columns(kWeight, kWeight + 1) |
           (clear ? Wanted::columns(kBaseColor, kBaseColor + 3) : Wanted::columns(kAlpha, kAlpha + 1));
}

// Whether a program computes some of them.
bool computes(const TextureView& textures, const int32_t* programs, size_t leaf, uint64_t columns) {
    if (!programs || programs[leaf] < 0) return false;
    const int32_t* first = textures.program_first + programs[leaf];
    return std::any_of(
        textures.code + first[0], textures.code + first[1], [columns](const TextureInstruction& i) {
            return i.op == static_cast<int32_t>(TextureOp::OUTPUT) && (columns >> i.data & 1) != 0;
        });
}

}  // namespace

std::vector<int32_t> passed_leaves(const SceneView& scene, const SceneTables& tables, const Wanted& wanted,
                                   bool geometry) {
    if (!(scene.all_flags & kHasTransparency)) return {};
    constexpr std::array textured = {"texture_pixels", "texture_attributes", "texture_lookups",
                                     "texture_constants"};
    const bool textures =
        std::any_of(textured.begin(), textured.end(), [&](const char* name) { return wanted.any(name); });
    std::vector<int32_t> out(tables.leaf_flags.size(), 0);
    for (size_t leaf = 0; leaf < out.size(); ++leaf) {
        if (!(tables.leaf_flags[leaf] & kHasTransparency)) continue;
        const uint64_t columns = share_columns(scene, leaf);
        const bool varies = computes(scene.textures, scene.textures.leaf_program, leaf, columns) ||
                            computes(scene.textures, scene.textures.leaf_weight_program, leaf, columns);
        bool asked = textures && varies;
        for (size_t c = 0; c < kMaterialParams; ++c)
            if (columns >> c & 1)
                asked |=
                    wanted.any("leaf_params", leaf * kMaterialParams + c, leaf * kMaterialParams + c + 1);
        out[leaf] = asked ? kShareChanges | kDarkChanges : geometry && varies ? kShareChanges : 0;
    }
    if (std::all_of(out.begin(), out.end(), [](int32_t bits) { return bits == 0; })) return {};
    return out;
}

}  // namespace edgegrad
