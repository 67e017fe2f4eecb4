// Runs texture programs, which evaluate the expressions of W shading points at once.
#pragma once

#include "scene/view.h"
#include "texture/point.h"

namespace edgegrad::EDGEGRAD_ISA {

// Runs one program for the lanes of the mask (interpreter.cpp).
void interpret(const SceneView& scene, const Mask& active, int32_t program, const TexturePoint& point,
               Float* row);

// Overwrites the values of each active lane's parameter row (scene/material_params.h) that the lane's program
// computes. -1: the lane has no program.
EG_INLINE void run_program(const SceneView& scene, Mask active, Int program, const TexturePoint& point,
                           Float* row) {
    Mask rest = active & (program >= 0);
    while (any(rest)) {
        int lane = 0;
        while (!rest[lane]) ++lane;
        const int32_t first = program[lane];
        const Mask same = rest & (program == first);
        interpret(scene, same, first, point, row);
        rest &= ~same;
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
