// Evaluation of BSDFs at given points and directions, for tests.
#pragma once

#include "shading/bsdf/bsdf.h"
#include "shading/bsdf/favoured_lobes.h"
#include "tasks/probe_tasks.h"

namespace edgegrad::EDGEGRAD_ISA {

// A packet of the task's points.
struct BsdfPoints {
    Mask active;
    Int at;  // relative to the packet's first point
    Bsdf bsdf;
    Vec3 wi;
};

EG_INLINE BsdfPoints load_points(const BsdfTask& task, int64_t first) {
    const Int lane = lane_index();
    const Mask active = lane < static_cast<int>(task.count - first < W ? task.count - first : W);
    const Int at = select(active, lane, splat(0));
    const Int material = gather(task.material + first, at);
    const auto vector = [&](const float* values) { return gather3(values + 3 * first, at); };
    Float row[kMaterialParams];
    gather_row(task.rows, kMaterialParams, material, row);
    return {active, at,
            make_bsdf(active, gather(task.kind, material), gather(task.flags, material), material_values(row),
                      vector(task.normal), vector(task.true_normal), vector(task.tangent),
                      gather(task.from_inside + first, at) != 0, vector(task.wo)),
            vector(task.wi)};
}

inline void bsdf_kernel(const BsdfTask& task, const BsdfResult& result) {
    for (int64_t first = 0; first < task.count; first += W) {
        const int left = static_cast<int>(task.count - first < W ? task.count - first : W);
        auto [active, at, f, wi] = load_points(task, first);
        if (task.favoured) favour(f, active, task.favoured, active);
        const auto number = [&, at = at](const float* values) { return gather(values + first, at); };
        const auto write = [&](float* out, int stride, Float value) {
            for (int i = 0; i < left; ++i) out[stride * (first + i)] = value[i];
        };
        const auto write3 = [&](float* out, Vec3 value) {
            write(out, 3, value.x), write(out + 1, 3, value.y), write(out + 2, 3, value.z);
        };
        const auto write_index = [&](int32_t* out, Int value) {
            for (int i = 0; i < left; ++i) out[first + i] = value[i];
        };
        const BsdfValue e = evaluate(f, active, wi);
        write3(result.value, e.value);
        write(result.pdf, 1, e.pdf);
        write3(result.emission, emitted(f));
        const BsdfSample s =
            sample(f, active, number(task.random[0]), number(task.random[1]), number(task.random[2]));
        write3(result.sample_wi, s.wi);
        write3(result.sample_weight, s.weight);
        write(result.sample_pdf, 1, s.pdf);
        write_index(result.sample_active, s.active & 1);
        write_index(result.sample_specular, s.specular & 1);
        write_index(result.sample_transmitted, s.transmitted & 1);
        write_index(result.sample_ray_kind, s.ray_kind);
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
