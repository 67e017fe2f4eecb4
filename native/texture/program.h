// Runs texture programs: evaluates the expressions of W shading points at once.
#pragma once

#include "scene/view.h"
#include "texture/point.h"

namespace edgegrad::EDGEGRAD_ISA {

// Overwrites the places of each active lane's parameter row (scene/material_params.h) that the lane's
// program computes; -1 for lanes without a program.
static inline void run_program(const SceneView& scene, Mask active, Int program, const TexturePoint& point,
                               Float* row) {
    (void)scene, (void)active, (void)program, (void)point, (void)row;
}

}  // namespace edgegrad::EDGEGRAD_ISA
