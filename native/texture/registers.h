// The registers of a texture program (scene/textures/opcodes.h).
#pragma once

#include "texture/color.h"
#include "texture/program.h"

namespace edgegrad::EDGEGRAD_ISA {

// The scalar registers of a running program, and the current instruction's access to them.
struct TextureRegisters {
    Float value[kTextureRegisters + 1];
    const float* constants;
    const TextureInstruction* at;

    EG_INLINE Float in(int k) const {
        const int32_t i = at->in[k];
        return i < 0 ? broadcast(constants + ~i) : value[i];
    }
    EG_INLINE Vec3 in3() const { return {in(0), in(1), in(2)}; }
    EG_INLINE void out(Float a) { value[at->out[0]] = a; }
    EG_INLINE void out(Vec3 a) {
        value[at->out[0]] = a.x;
        value[at->out[1]] = a.y;
        value[at->out[2]] = a.z;
    }
    EG_INLINE void out(const Color4& a) {
        for (int k = 0; k < 4; ++k) value[at->out[k]] = a.c[k];
    }
};

}  // namespace edgegrad::EDGEGRAD_ISA
