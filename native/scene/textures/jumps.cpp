#include "scene/textures/jumps.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <optional>
#include <span>
#include <utility>

#include "scene/closure_programs.h"
#include "scene/textures/opcodes.h"

namespace edgegrad {
namespace {

// Most borders between the rows of a table; those of tables of more are not added.
constexpr int kMostRows = 4;

// A linear function of the first three components of an attribute (-1: of none), and 1.
struct Linear {
    int32_t attribute = -1;
    double factor[4] = {0.0, 0.0, 0.0, 0.0};

    bool constant() const { return attribute < 0; }
};
// What a register holds: a linear function, or nothing that is known. `steps`: it is constant within cells
// whose grid has been found. `hue`: it jumps by whole numbers, which the colour of a hue does not show.
// `image`: it depends on values of images.
struct Value {
    std::optional<Linear> linear;
    bool steps = false, hue = false, image = false;

    bool positive() const { return linear && linear->constant() && linear->factor[3] > 0.0; }
    // Whether it is constant within the cells that have been found.
    bool level() const { return steps || (linear && linear->constant()); }
};

Value sum(const Value& first, const Value& second, double sign = 1.0) {
    const std::optional<Linear>&a = first.linear, &b = second.linear;
    if (!a || !b || (!a->constant() && !b->constant() && a->attribute != b->attribute)) return {};
    Linear out = *a;
    if (a->constant()) out.attribute = b->attribute;
    for (int k = 0; k < 4; ++k) out.factor[k] += sign * b->factor[k];
    return {out};
}

Value product(const Value& first, const Value& second) {
    const std::optional<Linear>&a = first.linear, &b = second.linear;
    if (!a || !b || (!a->constant() && !b->constant())) return {};
    Linear out = a->constant() ? *b : *a;
    const double scale = a->constant() ? a->factor[3] : b->factor[3];
    for (double& f : out.factor) f *= scale;
    return {out};
}

// Adds the grid of cells with these coordinates, as multiples of `scale`. Returns what is constant within
// cells, or nothing where they do not form a grid.
template <size_t N>
Value add_grid(TextureJumps& jumps, const std::array<Value, N>& coordinates,
               const std::array<double, N>& scale) {
    static_assert(N <= kCellCoordinates);
    CellGrid grid{-1, {}};
    Value all = coordinates[0];
    for (const Value& one : coordinates) all = sum(all, one);  // whether all are of one attribute
    if (!all.linear) {
        jumps.elsewhere = true;
        return {};
    }
    for (size_t k = 0; k < N; ++k) {
        const Linear& one = *coordinates[k].linear;
        grid.attribute = std::max(grid.attribute, one.attribute);
        for (size_t c = 0; c < 4; ++c) grid.row[k][c] = static_cast<float>(one.factor[c] * scale[k]);
    }
    const bool varies = grid.attribute >= 0;
    if (varies && std::find(jumps.grids.begin(), jumps.grids.end(), grid) == jumps.grids.end())
        jumps.grids.push_back(grid);
    return {{}, true};
}

// Adds the border at which a value is zero. As the first of cells that no face is as large as, it has the
// form of a grid.
Value add_zero(TextureJumps& jumps, const Value& value) {
    constexpr double kLargeCells = 1.0 / 1024.0;
    return add_grid<1>(jumps, {value}, {kLargeCells});
}

// Adds the borders between rows that differ of a table without interpolation.
Value add_rows(const TextureTables& t, const TextureLookup& table, TextureJumps& jumps, const Value& place) {
    if (place.level()) return {{}, true};
    const float* row = t.lookups.data() + table.offset;
    const double last = table.rows - 1;
    int found = 0;
    for (int32_t k = 1; k < table.rows; ++k, row += table.columns) {
        if (std::equal(row, row + table.columns, row + table.columns)) continue;
        if (++found > kMostRows || !place.linear) {
            jumps.elsewhere = true;
            return {};
        }
        const Value constant{Linear{-1, {0.0, 0.0, 0.0, last}}},
            border{Linear{-1, {0.0, 0.0, 0.0, -1.0 * k}}};
        add_zero(jumps, sum(product(place, constant), border));
    }
    return {{}, true};
}

// Whether a step may add to where its program jumps.
bool may_jump(const TextureTables& t, const TextureInstruction& step) {
    switch (static_cast<TextureOp>(step.op)) {
        case TextureOp::IMAGE:
            return t.images[static_cast<size_t>(step.data)].interpolation == kImageClosest;
        case TextureOp::LOOKUP:
            return t.tables[static_cast<size_t>(step.data)].interpolate == 0;
        case TextureOp::CHECKER:
        case TextureOp::FLOOR:
        case TextureOp::CEIL:
        case TextureOp::SELECT:
        case TextureOp::LESS_THAN:
        case TextureOp::GREATER_THAN:
        case TextureOp::EQUAL:
        case TextureOp::SIGN:
        case TextureOp::MODULO:
        case TextureOp::ARCTAN2:
        case TextureOp::RGB_TO_HSV:
        case TextureOp::RGB_TO_HSL:
        case TextureOp::HSV_TO_RGB:
        case TextureOp::BRICK:
        case TextureOp::WHITE_NOISE:
        case TextureOp::VORONOI:
            return true;
        default:
            return false;
    }
}

// Adds where one program jumps.
void add_jumps(const TextureTables& t, std::span<const TextureInstruction> program, TextureJumps& jumps) {
    std::vector<Value> registers(kTextureRegisters + 1);
    for (const TextureInstruction& step : program) {
        const auto in = [&](int k) -> Value {
            const int32_t place = step.in[k];
            if (place >= 0) return registers[static_cast<size_t>(place)];
            return {Linear{-1, {0.0, 0.0, 0.0, t.constants[static_cast<size_t>(~place)]}}};
        };
        // Whether the first inputs are constant within cells, so that the output is as well
        const auto level = [&](int inputs) {
            bool all = true;
            for (int k = 0; k < inputs; ++k) all &= in(k).level();
            return all;
        };
        const auto any = [&](bool Value::* is, int inputs) {
            bool one = false;
            for (int k = 0; k < inputs; ++k) one |= in(k).*is;
            return one;
        };
        const auto hue = [&](int inputs) { return any(&Value::hue, inputs); };
        constexpr int kInputs = std::size(decltype(step.in){});
        const auto op = static_cast<TextureOp>(step.op);
        const bool before = std::exchange(jumps.elsewhere, false), by_image = any(&Value::image, kInputs);
        // A hue that anything but a shift, a fractional part or a colour reads
        if (op != TextureOp::ADD && op != TextureOp::SUBTRACT && op != TextureOp::FLOOR)
            jumps.elsewhere |=
                hue(kInputs) && !((op == TextureOp::HSV_TO_RGB || op == TextureOp::HSL_TO_RGB) && in(0).hue);
        Value found[4];
        switch (op) {
            case TextureOp::ATTRIBUTE:
                for (int k = 0; k < 3; ++k) {
                    found[k].linear = Linear{step.data};
                    found[k].linear->factor[k] = 1.0;
                }
                break;
            case TextureOp::RAY_KIND:
            case TextureOp::RAY_BOUNCES:
            case TextureOp::BACKFACING:
                for (Value& one : found) one.steps = true;
                break;
            case TextureOp::ADD:
                found[0] = sum(in(0), in(1));
                found[0].steps = level(2), found[0].hue = hue(2);
                break;
            case TextureOp::SUBTRACT:
                found[0] = sum(in(0), in(1), -1.0);
                found[0].steps = level(2), found[0].hue = hue(2);
                break;
            case TextureOp::MULTIPLY:
                found[0] = product(in(0), in(1));
                found[0].steps = level(2);
                break;
            case TextureOp::MULTIPLY_ADD:
                found[0] = sum(product(in(0), in(1)), in(2));
                found[0].steps = level(3);
                break;
            case TextureOp::MINIMUM:
            case TextureOp::MAXIMUM:
                found[0].steps = level(2);
                break;
            case TextureOp::AFFINE:
                found[0] =
                    sum(sum(product(in(0), in(1)), product(in(2), in(3))), sum(product(in(4), in(5)), in(6)));
                break;
            case TextureOp::IMAGE: {
                const TextureImage& image = t.images[static_cast<size_t>(step.data)];
                if (may_jump(t, step))
                    std::fill_n(found, 4,
                                add_grid<2>(jumps, {in(0), in(1)}, {1.0 * image.width, 1.0 * image.height}));
                break;
            }
            case TextureOp::CHECKER:
                found[0] = add_grid<3>(jumps, {in(0), in(1), in(2)}, {1.0, 1.0, 1.0});
                break;
            case TextureOp::RGB_TO_HSV:
            case TextureOp::RGB_TO_HSL:
                found[0].hue = true;
                break;
            case TextureOp::HSV_TO_RGB:
                if (in(0).hue) break;
                jumps.past_hues |= !(in(0).linear && in(0).linear->constant());
                // The color's formula changes with each sixth of the hue, which is continuous within [0, 1]
                if (std::binary_search(t.leaving_hues.begin(), t.leaving_hues.end(),
                                       static_cast<int32_t>(&step - t.code.data())))
                    add_grid<1>(jumps, {in(0)}, {6.0});
                break;
            case TextureOp::BRICK:
                // Bricks of different tints meet in the mortar, which hides them and may end softly
                jumps.elsewhere |= !in(2).positive() || !in(3).positive();
                break;
            case TextureOp::FLOOR:
            case TextureOp::CEIL:
                if (in(0).hue)
                    found[0].hue = true;
                else
                    found[0] = add_grid<1>(jumps, {in(0)}, {1.0});
                break;
            case TextureOp::SELECT:
                jumps.elsewhere |= !in(0).level();
                found[0].steps = level(3);
                break;
            case TextureOp::LESS_THAN:
            case TextureOp::GREATER_THAN:
                if (level(2))
                    found[0].steps = true;
                else
                    found[0] = add_zero(jumps, sum(in(0), in(1), -1.0));
                break;
            case TextureOp::LOOKUP:
                if (may_jump(t, step)) {
                    const TextureLookup& table = t.tables[static_cast<size_t>(step.data)];
                    std::fill_n(found, 4, add_rows(t, table, jumps, in(0)));
                }
                break;
            case TextureOp::EQUAL:
            case TextureOp::SIGN:
            case TextureOp::MODULO:
            case TextureOp::ARCTAN2:
            case TextureOp::WHITE_NOISE:
            case TextureOp::VORONOI:
                jumps.elsewhere = true;
                break;
            default:
                break;
        }
        jumps.by_images |= jumps.elsewhere && by_image;
        jumps.elsewhere |= before;
        if (op == TextureOp::OUTPUT) continue;
        for (int k = 0; k < 4; ++k) {
            found[k].image = by_image || op == TextureOp::IMAGE;
            registers[static_cast<size_t>(step.out[k])] = found[k];
        }
    }
}

}  // namespace

TextureJumps texture_jumps(const SceneTables& tables, size_t closure) {
    TextureJumps jumps;
    for_each_program(tables, closure, [&](std::span<const TextureInstruction> program) {
        const bool any = std::any_of(program.begin(), program.end(), [&](const TextureInstruction& step) {
            return may_jump(tables.textures, step);
        });
        if (any) add_jumps(tables.textures, program, jumps);
    });
    return jumps;
}

MaterialJumps material_jumps(const SceneTables& tables) {
    MaterialJumps out;
    out.of.resize(tables.material_first_closure.size() - 1);
    for (size_t m = 0; m < out.of.size(); ++m) {
        TextureJumps& all = out.of[m];
        for (int32_t k = tables.material_first_closure[m]; k < tables.material_first_closure[m + 1]; ++k) {
            const TextureJumps jumps = texture_jumps(tables, static_cast<size_t>(k));
            all.elsewhere |= jumps.elsewhere, all.by_images |= jumps.by_images;
            for (const CellGrid& grid : jumps.grids)
                if (std::find(all.grids.begin(), all.grids.end(), grid) == all.grids.end())
                    all.grids.push_back(grid);
        }
        if (!all.any()) continue;
        out.any.resize(out.of.size(), 0);
        out.any[m] = 1;
    }
    return out;
}

}  // namespace edgegrad
