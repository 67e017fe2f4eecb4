#include "engine/decisions/value_sources.h"

#include <algorithm>
#include <array>
#include <iterator>

#include "scene/textures/opcodes.h"

namespace edgegrad {

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

namespace {

// Follows a program from its last step to its first, and adds what the requested columns depend on.
void follow(const TextureView& textures, const Requested& requested, int32_t program, uint64_t columns,
            ValueSources& out) {
    const int32_t* first = textures.program_first + program;
    std::array<bool, kTextureRegisters + 1> needed{};
    for (const TextureInstruction* step = textures.code + first[1]; step-- != textures.code + first[0];) {
        const bool result = step->op == static_cast<int32_t>(TextureOp::OUTPUT);
        bool counts = result && (columns >> step->data & 1) != 0;
        out.programs |= counts;
        for (const int32_t to : step->out) {
            if (result || to == kTextureScratch) continue;
            counts |= needed[static_cast<size_t>(to)];
            needed[static_cast<size_t>(to)] = false;
        }
        if (!counts) continue;
        out.requested |= reads_requested(textures, requested, *step);
        for (const int32_t in : step->in)
            if (in >= 0) needed[static_cast<size_t>(in)] = true;
    }
}

}  // namespace

ValueSources value_sources(const SceneView& scene, const Requested& requested, size_t closure,
                           uint64_t columns) {
    ValueSources out;
    out.requested = (requested.row_columns("closure_params", closure) & columns) != 0;
    const TextureView& t = scene.textures;
    for (const int32_t* programs : {t.closure_program, t.closure_weight_program, t.closure_normal_program})
        if (programs && programs[closure] >= 0) follow(t, requested, programs[closure], columns, out);
    return out;
}

}  // namespace edgegrad
