// Texture programs evaluated at given points. Tests compare them with Blender.
#pragma once

#include "tasks/probe_tasks.h"
#include "texture/program.h"

namespace edgegrad::EDGEGRAD_ISA {

// A packet of the task's points.
struct TexturePoints {
    Mask active;
    Int at;  // relative to the packet's first point
    Int program;
    TexturePoint point;
};

EG_INLINE TexturePoints load_points(const TextureTask& task, int64_t first) {
    const Int lane = lane_index();
    TexturePoints r;
    r.active = lane < static_cast<int>(task.count - first < W ? task.count - first : W);
    r.at = select(r.active, lane, splat(0));
    const auto number = [&](const float* values) { return gather(values + first, r.at); };
    const auto vector = [&](const float* values) { return gather3(values + 3 * first, r.at); };
    const auto index = [&](const int32_t* values) { return gather(values + first, r.at); };
    r.program = index(task.program);
    TexturePoint& p = r.point;
    p.face = index(task.face);
    p.instance = splat(-1);
    p.b1 = number(task.b1);
    p.b2 = number(task.b2);
    p.position = vector(task.position);
    p.normal = p.undisplaced = vector(task.normal);
    p.view = vector(task.view);
    p.backside = index(task.backside) != 0;
    p.ray_kind = index(task.ray_kind);
    p.true_normal = vector(task.true_normal);
    return r;
}

inline void texture_kernel(const SceneView& scene, const TextureTask& task, float* rows) {
    for (int64_t first = 0; first < task.count; first += W) {
        const int left = static_cast<int>(task.count - first < W ? task.count - first : W);
        const TexturePoints p = load_points(task, first);
        Float row[kMaterialParams];
        gather_row(rows + first * kMaterialParams, kMaterialParams, p.at, row);
        run_program(scene, p.active, p.program, p.point, row);
        for (int k = 0; k < kMaterialParams; ++k)
            for (int i = 0; i < left; ++i) rows[(first + i) * kMaterialParams + k] = row[k][i];
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
