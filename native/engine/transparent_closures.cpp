#include "engine/transparent_closures.h"

#include <algorithm>
#include <array>
#include <iterator>

#include "shading/transparent_surfaces.h"
#include "texture/opcodes.h"

namespace edgegrad {
namespace {

// Columns of a shader's row that its transparent share is made of.
uint64_t share_columns(const SceneView& scene, size_t leaf) {
    const bool clear = scene.leaf_kind[leaf] == kTransparent;
    return Wanted::columns(kWeight, kWeight + 1) |
           (clear ? Wanted::columns(kBaseColor, kBaseColor + 3) : Wanted::columns(kAlpha, kAlpha + 1));
}

// What a shader's programs say of some of its columns.
struct Computed {
    bool at_all = false;      // a program computes them
    bool from_asked = false;  // of texels, numbers or attributes that are asked for
};

// Whether a step reads from what is asked for by itself.
bool reads_asked(const TextureView& textures, const Wanted& wanted, const TextureInstruction& step) {
    const auto asked = [&wanted](const char* table, int64_t first, int64_t size) {
        return wanted.any(table, static_cast<size_t>(first), static_cast<size_t>(first + size));
    };
    switch (static_cast<TextureOp>(step.op)) {
        case TextureOp::IMAGE: {
            const TextureImage& image = textures.images[step.data];
            return asked("texture_pixels", image.offset,
                         static_cast<int64_t>(image.width) * image.height * image.channels);
        }
        case TextureOp::LOOKUP: {
            const TextureLookup& table = textures.tables[step.data];
            return asked("texture_lookups", table.offset, static_cast<int64_t>(table.rows) * table.columns);
        }
        case TextureOp::ATTRIBUTE:
            return wanted.any("texture_attributes");
        default:
            return std::any_of(std::begin(step.in), std::end(step.in),
                               [&](int32_t in) { return in < 0 && asked("texture_constants", ~in, 1); });
    }
}

// Follows a program back from its results.
Computed computed(const TextureView& textures, const Wanted& wanted, const int32_t* programs, size_t leaf,
                  uint64_t columns) {
    Computed out;
    if (!programs || programs[leaf] < 0) return out;
    const int32_t* first = textures.program_first + programs[leaf];
    std::array<bool, kTextureRegisters + 1> needed{};
    for (const TextureInstruction* step = textures.code + first[1]; step-- != textures.code + first[0];) {
        const bool result = step->op == static_cast<int32_t>(TextureOp::OUTPUT);
        bool counts = result && (columns >> step->data & 1) != 0;
        out.at_all |= counts;
        for (const int32_t to : step->out) {
            if (result || to == kTextureScratch) continue;
            counts |= needed[static_cast<size_t>(to)];
            needed[static_cast<size_t>(to)] = false;
        }
        if (!counts) continue;
        out.from_asked |= reads_asked(textures, wanted, *step);
        for (const int32_t in : step->in)
            if (in >= 0) needed[static_cast<size_t>(in)] = true;
    }
    return out;
}

}  // namespace

std::vector<int32_t> passed_leaves(const SceneView& scene, const SceneTables& tables, const Wanted& wanted,
                                   bool geometry) {
    if (!(scene.all_flags & kHasTransparency)) return {};
    std::vector<int32_t> out(tables.leaf_flags.size(), 0);
    for (size_t leaf = 0; leaf < out.size(); ++leaf) {
        if (!(tables.leaf_flags[leaf] & kHasTransparency)) continue;
        const uint64_t columns = share_columns(scene, leaf);
        const Computed values = computed(scene.textures, wanted, scene.textures.leaf_program, leaf, columns),
                       weight = computed(scene.textures, wanted, scene.textures.leaf_weight_program, leaf,
                                         columns);
        bool asked = values.from_asked || weight.from_asked;
        for (size_t c = 0; c < kMaterialParams; ++c)
            if (columns >> c & 1)
                asked |=
                    wanted.any("leaf_params", leaf * kMaterialParams + c, leaf * kMaterialParams + c + 1);
        const bool varies = geometry && (values.at_all || weight.at_all);
        out[leaf] = asked ? kShareChanges | kEndsChange : varies ? kShareChanges : 0;
    }
    if (std::all_of(out.begin(), out.end(), [](int32_t bits) { return bits == 0; })) return {};
    return out;
}

}  // namespace edgegrad
