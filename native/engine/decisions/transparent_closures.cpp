#include "engine/decisions/transparent_closures.h"

#include <algorithm>
#include <array>
#include <iterator>

#include "scene/textures/opcodes.h"
#include "tasks/transparent_surfaces.h"

namespace edgegrad {
namespace {

// Columns of a shader's row that its transparent share is made of.
uint64_t share_columns(const SceneView& scene, size_t closure) {
    const bool clear = scene.closure_kind[closure] == kTransparent;
    return Requested::columns(kWeight, kWeight + 1) |
           (clear ? Requested::columns(kBaseColor, kBaseColor + 3) : Requested::columns(kAlpha, kAlpha + 1));
}

// What a shader's programs say of some of its columns.
struct Computed {
    bool at_all = false;          // a program computes them
    bool from_requested = false;  // of texels, numbers or attributes that are asked for
};

// Whether a step reads from what is asked for by itself.
bool reads_requested(const TextureView& textures, const Requested& requested,
                     const TextureInstruction& step) {
    const auto any_of_table = [&requested](const char* table, int64_t first, int64_t size) {
        return requested.any(table, static_cast<size_t>(first), static_cast<size_t>(first + size));
    };
    switch (static_cast<TextureOp>(step.op)) {
        case TextureOp::IMAGE: {
            const TextureImage& image = textures.images[step.data];
            return any_of_table("texture_pixels", image.offset,
                                static_cast<int64_t>(image.width) * image.height * image.channels);
        }
        case TextureOp::LOOKUP: {
            const TextureLookup& table = textures.tables[step.data];
            return any_of_table("texture_lookups", table.offset,
                                static_cast<int64_t>(table.rows) * table.columns);
        }
        case TextureOp::ATTRIBUTE:
        case TextureOp::ATTRIBUTE_AT:
        case TextureOp::NORMAL_MAP:
            return requested.any("texture_attributes");
        default:
            return std::any_of(std::begin(step.in), std::end(step.in), [&](int32_t in) {
                return in < 0 && any_of_table("texture_constants", ~in, 1);
            });
    }
}

// Follows a program back from its results.
Computed computed(const TextureView& textures, const Requested& requested, const int32_t* programs,
                  size_t closure, uint64_t columns) {
    Computed out;
    if (!programs || programs[closure] < 0) return out;
    const int32_t* first = textures.program_first + programs[closure];
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
        out.from_requested |= reads_requested(textures, requested, *step);
        for (const int32_t in : step->in)
            if (in >= 0) needed[static_cast<size_t>(in)] = true;
    }
    return out;
}

}  // namespace

std::vector<int32_t> transparent_closures(const SceneView& scene, const SceneTables& tables,
                                          const Requested& requested, bool geometry) {
    if (!(scene.all_flags & kHasTransparency)) return {};
    std::vector<int32_t> out(tables.closure_flags.size(), 0);
    for (size_t closure = 0; closure < out.size(); ++closure) {
        if (!(tables.closure_flags[closure] & kHasTransparency)) continue;
        const uint64_t columns = share_columns(scene, closure);
        const Computed values = computed(scene.textures, requested, scene.textures.closure_program, closure,
                                         columns),
                       weight = computed(scene.textures, requested, scene.textures.closure_weight_program,
                                         closure, columns);
        bool share_requested = values.from_requested || weight.from_requested;
        for (size_t c = 0; c < kMaterialParams; ++c)
            if (columns >> c & 1)
                share_requested |= requested.any("closure_params", closure * kMaterialParams + c,
                                                 closure * kMaterialParams + c + 1);
        const bool varies = geometry && (values.at_all || weight.at_all);
        out[closure] = share_requested ? kShareChanges | kEndsChange : varies ? kShareChanges : 0;
    }
    if (std::all_of(out.begin(), out.end(), [](int32_t bits) { return bits == 0; })) return {};
    return out;
}

}  // namespace edgegrad
