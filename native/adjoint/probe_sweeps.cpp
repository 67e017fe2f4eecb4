// Derivatives of single parts of the shading code, for tests.
#include "adjoint/number.h"

#include "adjoint/adjoint_kernels.h"
#include "adjoint/scene_probes.h"
#include "shading/bsdf/bsdf_kernel.h"
#include "tasks/kernel_table.h"
#include "tasks/probe_tasks.h"
#include "texture/texture_kernel.h"

namespace edgegrad::EDGEGRAD_ISA {

namespace {

// Sweeps over the tape of a packet of points, each with `count` outputs.
void sweep_points(Tape& tape, const ProbeSweep& sweep, int64_t first, int64_t points, const Float* output,
                  int count) {
    const int left = static_cast<int>(points - first < W ? points - first : W);
    for (int k = 0; sweep.adjoint && k < count; ++k) {
        raw::Float adjoint = raw::splat(0.0f);
        for (int i = 0; i < left; ++i) adjoint[i] = sweep.adjoint[(first + i) * count + k];
        tape.seed(output[k].node, adjoint);
    }
    if (sweep.adjoint) {
        tape.backward();
        return;
    }
    tape.forward();
    for (int k = 0; k < count; ++k)
        for (int i = 0; i < left; ++i)
            sweep.tangent[(first + i) * count + k] = tape.derivative(output[k].node)[i];
}

void bsdf_derivatives_kernel(const BsdfTask& task, const ProbeSweep& sweep) {
    Tape tape(*sweep.memory, *sweep.tables);
    for (int64_t first = 0; first < task.count; first += W) {
        tape.clear();
        const BsdfPoints p = load_points(task, first);
        const Vec3 value = evaluate(p.bsdf, p.active, p.wi).value, emission = emitted(p.bsdf);
        const Float output[kBsdfOutputs] = {value.x, value.y, value.z, emission.x, emission.y, emission.z};
        sweep_points(tape, sweep, first, task.count, output, kBsdfOutputs);
    }
}

void texture_derivatives_kernel(const SceneView& scene, const TextureTask& task, const float* rows,
                                const ProbeSweep& sweep) {
    Tape tape(*sweep.memory, *sweep.tables);
    for (int64_t first = 0; first < task.count; first += W) {
        tape.clear();
        const TexturePoints p = load_points(task, first);
        Float row[kMaterialParams];
        gather_row(rows + first * kMaterialParams, kMaterialParams, p.at, row);
        run_program(scene, p.active, p.program, p.point, row);
        sweep_points(tape, sweep, first, task.count, row, kMaterialParams);
    }
}

void scene_derivatives_kernel(const SceneView& scene, const SceneProbe& probe, const ProbeSweep& sweep) {
    Tape tape(*sweep.memory, *sweep.tables);
    for (int64_t first = 0; first < probe.count; first += W) {
        tape.clear();
        const SceneProbePacket p = run_scene_probe(scene, probe, first);
        const int left = static_cast<int>(probe.count - first < W ? probe.count - first : W);
        for (int k = 0; probe.value && k < kSceneOutputs; ++k)
            for (int i = 0; i < left; ++i) probe.value[(first + i) * kSceneOutputs + k] = p.output[k][i];
        sweep_points(tape, sweep, first, probe.count, p.output, kSceneOutputs);
    }
}

}  // namespace

void add_adjoint_probe_kernels(KernelTable& table) {
    table.bsdf_derivatives = bsdf_derivatives_kernel;
    table.texture_derivatives = texture_derivatives_kernel;
    table.scene_derivatives = scene_derivatives_kernel;
}

}  // namespace edgegrad::EDGEGRAD_ISA
