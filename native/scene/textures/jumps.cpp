#include "scene/textures/jumps.h"

#include <algorithm>
#include <optional>

#include "scene/textures/opcodes.h"

namespace edgegrad {
namespace {

// A linear function of the first three components of an attribute (-1: of none), and 1.
struct Linear {
    int32_t attribute = -1;
    double factor[4] = {0.0, 0.0, 0.0, 0.0};

    bool constant() const { return attribute < 0; }
};
using Value = std::optional<Linear>;  // nothing: another function

Value sum(const Value& a, const Value& b, double sign = 1.0) {
    if (!a || !b || (!a->constant() && !b->constant() && a->attribute != b->attribute)) return {};
    Linear out = *a;
    if (a->constant()) out.attribute = b->attribute;
    for (int k = 0; k < 4; ++k) out.factor[k] += sign * b->factor[k];
    return out;
}

Value product(const Value& a, const Value& b) {
    if (!a || !b || (!a->constant() && !b->constant())) return {};
    Linear out = a->constant() ? *b : *a;
    const double scale = a->constant() ? a->factor[3] : b->factor[3];
    for (double& f : out.factor) f *= scale;
    return out;
}

// The grid of an image that is looked up at (u, v); nothing: its texels do not form a grid. An attribute of
// -1: all points read the same texel.
std::optional<TexelGrid> grid_of(const TextureImage& image, const Value& u, const Value& v) {
    if (!sum(u, v)) return {};
    TexelGrid grid{std::max(u->attribute, v->attribute), {}, {}};
    for (int k = 0; k < 4; ++k) {
        grid.across[k] = static_cast<float>(u->factor[k] * image.width);
        grid.up[k] = static_cast<float>(v->factor[k] * image.height);
    }
    return grid;
}

// Adds where one program jumps.
void add_jumps(const TextureTables& t, int32_t program, TextureJumps& jumps) {
    std::vector<Value> registers(kTextureRegisters + 1);
    const int32_t* range = t.program_first.data() + program;
    for (int32_t at = range[0]; at < range[1]; ++at) {
        const TextureInstruction& step = t.code[static_cast<size_t>(at)];
        const auto in = [&](int k) -> Value {
            const int32_t place = step.in[k];
            if (place >= 0) return registers[static_cast<size_t>(place)];
            return Linear{-1, {0.0, 0.0, 0.0, t.constants[static_cast<size_t>(~place)]}};
        };
        Value found[4];
        switch (static_cast<TextureOp>(step.op)) {
            case TextureOp::ATTRIBUTE:
                for (int k = 0; k < 3; ++k) {
                    found[k] = Linear{step.data};
                    found[k]->factor[k] = 1.0;
                }
                break;
            case TextureOp::ADD:
                found[0] = sum(in(0), in(1));
                break;
            case TextureOp::SUBTRACT:
                found[0] = sum(in(0), in(1), -1.0);
                break;
            case TextureOp::MULTIPLY:
                found[0] = product(in(0), in(1));
                break;
            case TextureOp::MULTIPLY_ADD:
                found[0] = sum(product(in(0), in(1)), in(2));
                break;
            case TextureOp::AFFINE:
                found[0] = sum(sum(product(in(0), in(1)), product(in(2), in(3))),
                               sum(product(in(4), in(5)), in(6)));
                break;
            case TextureOp::IMAGE: {
                const TextureImage& image = t.images[static_cast<size_t>(step.data)];
                if (image.interpolation != kImageClosest) break;
                const std::optional<TexelGrid> grid = grid_of(image, in(0), in(1));
                if (!grid)
                    jumps.elsewhere = true;
                else if (grid->attribute >= 0 &&
                         std::find(jumps.grids.begin(), jumps.grids.end(), *grid) == jumps.grids.end())
                    jumps.grids.push_back(*grid);
                break;
            }
            case TextureOp::LOOKUP:
                jumps.elsewhere |= t.tables[static_cast<size_t>(step.data)].interpolate == 0;
                break;
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
                jumps.elsewhere = true;
                break;
            default:
                break;
        }
        if (static_cast<TextureOp>(step.op) == TextureOp::OUTPUT) continue;
        for (int k = 0; k < 4; ++k) registers[static_cast<size_t>(step.out[k])] = found[k];
    }
}

}  // namespace

TextureJumps texture_jumps(const SceneTables& tables, size_t closure) {
    TextureJumps jumps;
    const TextureTables& t = tables.textures;
    for (const auto* programs : {&t.closure_program, &t.closure_weight_program, &t.closure_normal_program}) {
        const int32_t program = closure < programs->size() ? (*programs)[closure] : -1;
        if (program >= 0) add_jumps(t, program, jumps);
    }
    return jumps;
}

}  // namespace edgegrad
