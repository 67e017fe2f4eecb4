#include "scene/textures/value_bounds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "scene/closure_programs.h"
#include "scene/material_params.h"

namespace edgegrad {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

struct Bounds {
    float least = -kInfinity, most = kInfinity;
};

Bounds operator+(Bounds a, Bounds b) { return {a.least + b.least, a.most + b.most}; }
Bounds operator-(Bounds a, Bounds b) { return {a.least - b.most, a.most - b.least}; }
Bounds operator*(Bounds a, Bounds b) {
    const std::array<float, 4> ends{a.least * b.least, a.least * b.most, a.most * b.least, a.most * b.most};
    // 0 times infinity
    if (std::any_of(ends.begin(), ends.end(), [](float x) { return std::isnan(x); })) return {};
    return {*std::min_element(ends.begin(), ends.end()), *std::max_element(ends.begin(), ends.end())};
}

Bounds range_of(const float* first, size_t count) {
    if (count == 0) return {};
    const auto ends = std::minmax_element(first, first + count);
    return {*ends.first, *ends.second};
}

// All channels together. Missing channels are 1, and 0 is beyond the border of clipped images.
Bounds bounds_of(TextureTables& t, size_t number) {
    const TextureImage& image = t.images[number];
    if (image.unassociate || image.interpolation == kImageCubic || t.pixels.size() == 0) return {};
    auto& known = t.image_range[number];
    if (!known) {
        const Bounds all = range_of(t.pixels.data() + image.offset, static_cast<size_t>(image.width) *
                                                                        static_cast<size_t>(image.height) *
                                                                        static_cast<size_t>(image.channels));
        known = {all.least, all.most};
    }
    const auto [least, most] = *known;
    return {image.extension == kImageClip ? std::min(least, 0.0f) : least, std::max(most, 1.0f)};
}

Bounds bounds_of(const TextureTables& t, const TextureLookup& table) {
    if (table.extrapolate) return {};
    return range_of(t.lookups.data() + table.offset,
                    static_cast<size_t>(table.rows) * static_cast<size_t>(table.columns));
}

// The bounds of all outputs of a step.
template <typename In>
Bounds bounds_of(TextureTables& t, const TextureInstruction& step, const In& in) {
    switch (static_cast<TextureOp>(step.op)) {
        case TextureOp::IMAGE:
            return bounds_of(t, static_cast<size_t>(step.data));
        case TextureOp::LOOKUP:
            return bounds_of(t, t.tables[static_cast<size_t>(step.data)]);
        case TextureOp::ADD:
            return in(0) + in(1);
        case TextureOp::SUBTRACT:
            return in(0) - in(1);
        case TextureOp::MULTIPLY:
            return in(0) * in(1);
        case TextureOp::MULTIPLY_ADD:
            return in(0) * in(1) + in(2);
        case TextureOp::AFFINE:
            return in(0) * in(1) + in(2) * in(3) + in(4) * in(5) + in(6);
        case TextureOp::MINIMUM:
            return {std::min(in(0).least, in(1).least), std::min(in(0).most, in(1).most)};
        case TextureOp::MAXIMUM:
            return {std::max(in(0).least, in(1).least), std::max(in(0).most, in(1).most)};
        case TextureOp::CLAMP:
            return {std::min(std::max(in(0).least, in(1).least), in(2).least),
                    std::min(std::max(in(0).most, in(1).most), in(2).most)};
        default:
            return {};
    }
}

// A lower bound of a column of a closure's row.
float least_value(SceneTables& tables, size_t closure, int32_t column) {
    if (!is_textured(tables, closure, column))
        return tables.closure_params[closure * kMaterialParams + static_cast<size_t>(column)];
    TextureTables& t = tables.textures;
    const int32_t program = t.closure_program[closure];
    if (program < 0) return -kInfinity;
    const TextureInstruction* first = t.code.data() + t.program_first[static_cast<size_t>(program)];
    const TextureInstruction* last = t.code.data() + t.program_first[static_cast<size_t>(program) + 1];
    const auto count = static_cast<size_t>(last - first);
    const auto writes = [](const TextureInstruction& step) {
        return step.op != static_cast<int32_t>(TextureOp::OUTPUT);
    };
    // Follow the program back from the column
    std::vector<uint8_t> counts(count, 0);
    std::array<bool, kTextureRegisters + 1> needed{};
    for (size_t k = count; k-- > 0;) {
        const TextureInstruction& step = first[k];
        bool used = !writes(step) && step.data == column;
        for (const int32_t to : step.out)
            if (writes(step) && to != kTextureScratch) {
                used |= needed[static_cast<size_t>(to)];
                needed[static_cast<size_t>(to)] = false;
            }
        counts[k] = used;
        for (const int32_t in : step.in)
            if (used && in >= 0) needed[static_cast<size_t>(in)] = true;
    }
    // Evaluate it with bounds
    std::array<Bounds, kTextureRegisters + 1> registers{};
    float least = -kInfinity;
    for (size_t k = 0; k < count; ++k) {
        if (!counts[k]) continue;
        const TextureInstruction& step = first[k];
        const auto in = [&](size_t i) {
            const int32_t from = step.in[i];
            if (from >= 0) return registers[static_cast<size_t>(from)];
            const float constant = t.constants[static_cast<size_t>(~from)];
            return Bounds{constant, constant};
        };
        if (!writes(step)) {
            least = in(0).least;
            continue;
        }
        const Bounds result = bounds_of(t, step, in);
        for (const int32_t to : step.out) registers[static_cast<size_t>(to)] = result;
    }
    return least;
}

bool may_shine(const SceneTables& tables, size_t closure) {
    return (tables.closure_flags[closure] & (kHasGlossy | kHasRefraction)) != 0;
}

}  // namespace

void bound_roughness(SceneTables& tables) {
    tables.textures.image_range.resize(tables.textures.images.size());
    std::vector<float>& out = tables.least_roughness;
    out.assign(2 * tables.closure_flags.size(), 0.0f);
    for (size_t closure = 0; closure < tables.closure_flags.size(); ++closure) {
        if (!may_shine(tables, closure)) continue;
        out[2 * closure] = least_value(tables, closure, kRoughness);
        out[2 * closure + 1] = least_value(tables, closure, kCoatRoughness);
    }
}

}  // namespace edgegrad
