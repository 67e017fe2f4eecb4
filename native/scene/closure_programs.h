// Queries of the texture programs of closures.
#pragma once

#include <algorithm>
#include <span>

#include "scene/tables.h"
#include "scene/textures/opcodes.h"

namespace edgegrad {

// Calls visit(instructions) for a closure's program, and for those of its weight and normal.
template <typename Visit>
void for_each_program(const SceneTables& tables, size_t closure, const Visit& visit) {
    const TextureTables& t = tables.textures;
    for (const auto* programs : {&t.closure_program, &t.closure_weight_program, &t.closure_normal_program}) {
        const int32_t program = closure < programs->size() ? (*programs)[closure] : -1;
        if (program < 0) continue;
        const int32_t* range = t.program_first.data() + program;
        visit(std::span<const TextureInstruction>(t.code.data() + range[0], t.code.data() + range[1]));
    }
}

// Returns whether `is` holds for any instruction of these programs.
template <typename Is>
bool any_step(const SceneTables& tables, size_t closure, const Is& is) {
    bool found = false;
    for_each_program(tables, closure, [&](std::span<const TextureInstruction> steps) {
        found = found || std::any_of(steps.begin(), steps.end(), is);
    });
    return found;
}

// Returns whether a texture computes a column of a closure.
inline bool is_textured(const SceneTables& tables, size_t closure, int32_t column) {
    return any_step(tables, closure, [column](const TextureInstruction& step) {
        return step.op == static_cast<int32_t>(TextureOp::OUTPUT) && step.data == column;
    });
}

}  // namespace edgegrad
