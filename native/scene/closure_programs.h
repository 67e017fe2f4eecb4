// What the texture programs of shaders do.
#pragma once

#include <algorithm>

#include "scene/tables.h"
#include "texture/opcodes.h"

namespace edgegrad {

// Whether some step of a shader's program, and that of its weight, is such.
template <typename Is>
bool any_step(const SceneTables& tables, size_t leaf, const Is& is) {
    const TextureTables& t = tables.textures;
    for (const auto* programs : {&t.leaf_program, &t.leaf_weight_program}) {
        const int32_t program = leaf < programs->size() ? (*programs)[leaf] : -1;
        if (program < 0) continue;
        const int32_t* range = t.program_first.data() + program;
        if (std::any_of(t.code.data() + range[0], t.code.data() + range[1], is)) return true;
    }
    return false;
}

// Whether a texture gives a shader's column.
inline bool is_textured(const SceneTables& tables, size_t leaf, int32_t column) {
    return any_step(tables, leaf, [column](const TextureInstruction& step) {
        return step.op == static_cast<int32_t>(TextureOp::OUTPUT) && step.data == column;
    });
}

}  // namespace edgegrad
