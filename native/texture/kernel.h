// Texture programs at given points: what tests compare with Blender.
#pragma once

#include "kernels.h"
#include "texture/program.h"

namespace edgegrad::EDGEGRAD_ISA {

static void texture_kernel(const SceneView& scene, const TextureTask& task, float* rows) {
    for (int64_t first = 0; first < task.count; first += W) {
        const Int lane = lane_index();
        const int left = static_cast<int>(task.count - first < W ? task.count - first : W);
        const Mask active = lane < left;
        const Int at = select(active, lane, splat(0));
        const auto number = [&](const float* values) { return gather(values + first, at); };
        const auto vector = [&](const float* values) { return gather3(values + 3 * first, at); };
        const auto index = [&](const int32_t* values) { return gather(values + first, at); };
        TexturePoint p;
        p.face = index(task.face);
        p.instance = splat(-1);
        p.b1 = number(task.b1);
        p.b2 = number(task.b2);
        p.position = vector(task.position);
        p.normal = vector(task.normal);
        p.view = vector(task.view);
        p.backside = index(task.backside) != 0;
        p.ray_kind = index(task.ray_kind);
        p.true_normal = vector(task.true_normal);
        Float row[kMaterialParams];
        for (int k = 0; k < kMaterialParams; ++k)
            for (int i = 0; i < W; ++i) row[k][i] = rows[(first + at[i]) * kMaterialParams + k];
        run_program(scene, active, index(task.program), p, row);
        for (int k = 0; k < kMaterialParams; ++k)
            for (int i = 0; i < left; ++i) rows[(first + i) * kMaterialParams + k] = row[k][i];
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
