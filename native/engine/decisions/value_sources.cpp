#include "engine/decisions/value_sources.h"

#include <array>
#include <bit>
#include <limits>

#include "scene/textures/opcodes.h"

namespace edgegrad {
namespace {

// Visits the floats that a program's step reads.
template <typename Visit>
void visit_reads(const TextureView& textures, const TextureInstruction& step, const Visit& visit) {
    const auto floats = [&visit](FloatTable table, int64_t first, int64_t size) {
        visit(FloatSpan{table, static_cast<size_t>(first), static_cast<size_t>(first + size)});
    };
    switch (static_cast<TextureOp>(step.op)) {
        case TextureOp::IMAGE: {
            const TextureImage& image = textures.images[step.data];
            floats(FloatTable::kTexturePixels, image.offset,
                   static_cast<int64_t>(image.width) * image.height * image.channels);
            break;
        }
        case TextureOp::LOOKUP: {
            const TextureLookup& table = textures.tables[step.data];
            floats(FloatTable::kTextureLookups, table.offset,
                   static_cast<int64_t>(table.rows) * table.columns);
            break;
        }
        case TextureOp::ATTRIBUTE:
        case TextureOp::ATTRIBUTE_AT:
        case TextureOp::NORMAL_MAP:
            floats(FloatTable::kTextureAttributes, 0, std::numeric_limits<int64_t>::max());
            break;
        default:
            for (const int32_t in : step.in)
                if (in < 0) floats(FloatTable::kTextureConstants, ~in, 1);
    }
}

// Follows a program from its last step to its first, and visits what some columns depend on. Returns whether
// the program computes some of them.
template <typename Visit>
bool follow(const TextureView& textures, int32_t program, uint64_t columns, const Visit& visit) {
    const int32_t* first = textures.program_first + program;
    std::array<bool, kTextureRegisters + 1> needed{};
    bool computes = false;
    for (const TextureInstruction* step = textures.code + first[1]; step-- != textures.code + first[0];) {
        const bool result = step->op == static_cast<int32_t>(TextureOp::OUTPUT);
        bool counts = result && (columns >> step->data & 1) != 0;
        computes |= counts;
        for (const int32_t to : step->out) {
            if (result || to == kTextureScratch) continue;
            counts |= needed[static_cast<size_t>(to)];
            needed[static_cast<size_t>(to)] = false;
        }
        if (!counts) continue;
        visit_reads(textures, *step, visit);
        for (const int32_t in : step->in)
            if (in >= 0) needed[static_cast<size_t>(in)] = true;
    }
    return computes;
}

}  // namespace

bool reads_requested(const TextureView& textures, const Requested& requested,
                     const TextureInstruction& step) {
    bool out = false;
    visit_reads(textures, step, [&](const FloatSpan& s) { out |= requested.any(s.table, s.first, s.last); });
    return out;
}

bool visit_sources(const SceneView& scene, size_t closure, uint64_t columns, const VisitFloats& visit) {
    const size_t row = closure * kMaterialParams;
    for (uint64_t left = columns; left != 0;) {
        const int first = std::countr_zero(left), count = std::countr_one(left >> first);
        visit({FloatTable::kClosures, row + static_cast<size_t>(first),
               row + static_cast<size_t>(first + count)});
        left &= ~Requested::columns(first, first + count);
    }
    bool programs = false;
    const TextureView& t = scene.textures;
    for (const int32_t* of : {t.closure_program, t.closure_weight_program, t.closure_normal_program})
        if (of && of[closure] >= 0) programs |= follow(t, of[closure], columns, visit);
    return programs;
}

ValueSources value_sources(const SceneView& scene, const Requested& requested, size_t closure,
                           uint64_t columns) {
    ValueSources out;
    out.programs = visit_sources(scene, closure, columns, [&](const FloatSpan& s) {
        out.requested |= requested.any(s.table, s.first, s.last);
    });
    return out;
}

}  // namespace edgegrad
