// Operations of texture programs, in the order of core/tables/textures/ops.py. interpreter.cpp defines what
// each operation computes.
#pragma once

#include <cstdint>

// clang-format off
#define EDGEGRAD_TEXTURE_OPS(X)                                                                             \
    X(OUTPUT) X(POSITION) X(NORMAL) X(TRUE_NORMAL) X(INCOMING) X(BACKFACING) X(RAY_KIND) X(ATTRIBUTE)       \
    X(IMAGE) X(LOOKUP) X(ADD) X(SUBTRACT) X(MULTIPLY) X(DIVIDE) X(MULTIPLY_ADD) X(AFFINE) X(MINIMUM)        \
    X(MAXIMUM) X(CLAMP) X(LESS_THAN) X(GREATER_THAN) X(EQUAL) X(SELECT) X(ABSOLUTE) X(SIGN) X(FLOOR)        \
    X(CEIL) X(SQRT) X(INVERSE_SQRT) X(POWER) X(LOG) X(EXPONENT) X(MODULO) X(SINE) X(COSINE) X(TANGENT)      \
    X(ARCSINE) X(ARCCOSINE) X(ARCTAN2) X(SINH) X(COSH) X(TANH) X(FRESNEL) X(RGB_TO_HSV) X(HSV_TO_RGB)       \
    X(RGB_TO_HSL) X(HSL_TO_RGB) X(CHECKER) X(BRICK) X(WHITE_NOISE) X(NOISE) X(VORONOI) X(SURFACE_TANGENT)   \
    X(BARYCENTRICS) X(ATTRIBUTE_AT) X(BUMP) X(NORMAL_MAP) X(SQUARE_SCALE) X(RAY_BOUNCES) X(RAY_LENGTH)
// clang-format on

namespace edgegrad {

enum class TextureOp : int32_t {
#define EDGEGRAD_TEXTURE_OP(name) name,
    EDGEGRAD_TEXTURE_OPS(EDGEGRAD_TEXTURE_OP)
#undef EDGEGRAD_TEXTURE_OP
};

// Whether a step reads what a ray has passed through before (texture/point.h, RayHistory).
template <typename Instruction>
bool reads_ray_history(const Instruction& step) {
    return step.op == static_cast<int32_t>(TextureOp::RAY_BOUNCES) ||
           step.op == static_cast<int32_t>(TextureOp::RAY_LENGTH);
}

}  // namespace edgegrad
