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

// All values of an attribute together. Meshes without it have 0.
Bounds read_attribute(const SceneTables& tables, size_t number) {
    const TextureTables& t = tables.textures;
    if (!tables.fields.empty()) return {};
    const auto meshes = static_cast<size_t>(tables.first_field());
    Bounds all{kInfinity, -kInfinity};
    for (size_t mesh = 0; mesh < meshes; ++mesh) {
        const TextureAttribute& a = t.mesh_attributes[number * (t.mesh_extent.size() / kMeshExtent) + mesh];
        if (a.components < 0) return {};  // by instance
        const int64_t first = tables.mesh_first_face[mesh], last = tables.mesh_first_face[mesh + 1];
        const Bounds one = a.components == 0
                               ? Bounds{0.0f, 0.0f}
                               : range_of(t.attributes.data() + a.offset + 3 * first * a.components,
                                          static_cast<size_t>(3 * (last - first) * a.components));
        all = {std::min(all.least, one.least), std::max(all.most, one.most)};
    }
    return all;
}

Bounds bounds_of_attribute(SceneTables& tables, size_t number) {
    auto& range = tables.textures.attribute_range;
    if (range.size() <= number) range.resize(number + 1);
    auto& known = range[number];
    if (!known) {
        const Bounds all = read_attribute(tables, number);
        known = {all.least, all.most};
    }
    return {(*known)[0], (*known)[1]};
}

// Noise that is normalized lies in [0, 1], if it is the sum of its octaves. The bits are those of
// core/tables/textures/lower_procedural.py.
Bounds bounds_of_noise(int32_t data) {
    constexpr int32_t kKind = 7 << 2, kNormalized = 1 << 5;  // kind 0 is the sum of octaves
    return (data & (kKind | kNormalized)) == kNormalized ? Bounds{0.0f, 1.0f} : Bounds{};
}

// The bounds of all outputs of a step.
template <typename In>
Bounds bounds_of(SceneTables& tables, const TextureInstruction& step, const In& in) {
    TextureTables& t = tables.textures;
    const auto number = static_cast<size_t>(step.data);
    switch (static_cast<TextureOp>(step.op)) {
        case TextureOp::ATTRIBUTE:
            return bounds_of_attribute(tables, number);
        case TextureOp::NOISE:
            return bounds_of_noise(step.data);
        case TextureOp::IMAGE:
            return bounds_of(t, number);
        case TextureOp::LOOKUP:
            return bounds_of(t, t.tables[number]);
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

// Whether the bounds of a step's outputs depend on those of its inputs.
bool passes_bounds(const TextureInstruction& step) {
    switch (static_cast<TextureOp>(step.op)) {
        case TextureOp::ADD:
        case TextureOp::SUBTRACT:
        case TextureOp::MULTIPLY:
        case TextureOp::MULTIPLY_ADD:
        case TextureOp::AFFINE:
        case TextureOp::MINIMUM:
        case TextureOp::MAXIMUM:
        case TextureOp::CLAMP:
            return true;
        default:
            return false;
    }
}

bool is_output(const TextureInstruction& step) { return step.op == static_cast<int32_t>(TextureOp::OUTPUT); }

// Calls visit(step, bounds of its first input) for the steps of a program for which wanted(step) is true.
// Nothing is evaluated but what these depend on.
template <typename Wanted, typename Visit>
void visit_bounds(SceneTables& tables, size_t program, const Wanted& wanted, const Visit& visit) {
    const TextureTables& t = tables.textures;
    const TextureInstruction* first = t.code.data() + t.program_first[program];
    const auto count = static_cast<size_t>(t.program_first[program + 1] - t.program_first[program]);
    // Follow the program back from those steps
    std::vector<uint8_t> counts(count, 0);
    std::array<bool, kTextureRegisters + 1> needed{};
    for (size_t k = count; k-- > 0;) {
        const TextureInstruction& step = first[k];
        bool used = wanted(step);
        for (const int32_t to : step.out)
            if (!is_output(step) && to != kTextureScratch) {
                used |= needed[static_cast<size_t>(to)];
                needed[static_cast<size_t>(to)] = false;
            }
        counts[k] = used;
        if (!used || !(wanted(step) || passes_bounds(step))) continue;
        for (const int32_t in : step.in)
            if (in >= 0) needed[static_cast<size_t>(in)] = true;
    }
    // Evaluate it with bounds
    std::array<Bounds, kTextureRegisters + 1> registers{};
    for (size_t k = 0; k < count; ++k) {
        if (!counts[k]) continue;
        const TextureInstruction& step = first[k];
        const auto in = [&](size_t i) {
            const int32_t from = step.in[i];
            if (from >= 0) return registers[static_cast<size_t>(from)];
            const float constant = t.constants[static_cast<size_t>(~from)];
            return Bounds{constant, constant};
        };
        if (wanted(step)) visit(step, in(0));
        if (is_output(step)) continue;
        const Bounds result = bounds_of(tables, step, in);
        for (const int32_t to : step.out) registers[static_cast<size_t>(to)] = result;
    }
}

// A lower bound of a column of a closure's row.
float least_value(SceneTables& tables, size_t closure, int32_t column) {
    if (!is_textured(tables, closure, column))
        return tables.closure_params[closure * kMaterialParams + static_cast<size_t>(column)];
    const int32_t program = tables.textures.closure_program[closure];
    float least = -kInfinity;
    if (program >= 0)
        visit_bounds(
            tables, static_cast<size_t>(program),
            [&](const TextureInstruction& step) { return is_output(step) && step.data == column; },
            [&](const TextureInstruction&, Bounds value) { least = value.least; });
    return least;
}

// The steps that make colors of hues that may leave [0, 1].
std::vector<int32_t> leaving_hues(SceneTables& tables) {
    const TextureTables& t = tables.textures;
    const auto colors = [](const TextureInstruction& step) {
        return step.op == static_cast<int32_t>(TextureOp::HSV_TO_RGB);
    };
    std::vector<int32_t> out;
    if (std::none_of(t.code.begin(), t.code.end(), colors)) return out;
    for (size_t program = 0; program + 1 < t.program_first.size(); ++program)
        visit_bounds(tables, program, colors, [&](const TextureInstruction& step, Bounds hue) {
            if (hue.least < 0.0f || hue.most > 1.0f)
                out.push_back(static_cast<int32_t>(&step - t.code.data()));
        });
    return out;
}

bool may_shine(const SceneTables& tables, size_t closure) {
    return (tables.closure_flags[closure] & (kHasGlossy | kHasRefraction)) != 0;
}

}  // namespace

void bound_values(SceneTables& tables) {
    tables.textures.image_range.resize(tables.textures.images.size());
    tables.textures.leaving_hues = leaving_hues(tables);
    std::vector<float>& out = tables.least_roughness;
    out.assign(2 * tables.closure_flags.size(), 0.0f);
    for (size_t closure = 0; closure < tables.closure_flags.size(); ++closure) {
        if (!may_shine(tables, closure)) continue;
        out[2 * closure] = least_value(tables, closure, kRoughness);
        out[2 * closure + 1] = least_value(tables, closure, kCoatRoughness);
    }
}

}  // namespace edgegrad
