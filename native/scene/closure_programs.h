// What the texture programs of shaders do.
#pragma once

#include <algorithm>

#include "scene/tables.h"
#include "scene/textures/opcodes.h"

namespace edgegrad {

// Whether some step of a shader's program, and that of its weight, is such.
template <typename Is>
bool any_step(const SceneTables& tables, size_t closure, const Is& is) {
    const TextureTables& t = tables.textures;
    for (const auto* programs : {&t.closure_program, &t.closure_weight_program}) {
        const int32_t program = closure < programs->size() ? (*programs)[closure] : -1;
        if (program < 0) continue;
        const int32_t* range = t.program_first.data() + program;
        if (std::any_of(t.code.data() + range[0], t.code.data() + range[1], is)) return true;
    }
    return false;
}

// Whether a texture gives a shader's column.
inline bool is_textured(const SceneTables& tables, size_t closure, int32_t column) {
    return any_step(tables, closure, [column](const TextureInstruction& step) {
        return step.op == static_cast<int32_t>(TextureOp::OUTPUT) && step.data == column;
    });
}

}  // namespace edgegrad
