// The picture's kernel of one instruction set, and the paths that it shares with the primary boundary's.
#include "kernels/parts.h"
#include "path/radiance.h"
#include "path/touched_vertices.h"
#include "path/value_sweeps.h"
#include "tasks/image_task.h"
#include "tasks/kernel_table.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

void run_paths(const SceneView& scene, const ImageTask& task, Workspace& work, int count) {
    work.task = &task;
    while (true) {
        count = shade_paths(scene, task, work, count);
        work.hits.edges = nullptr;
        if (count == 0) return;
        trace_paths(scene, work, count);
    }
}

void add_path_kernels(KernelTable& table) {
    table.radiance = radiance_kernel;
    table.record = record_kernel;
    table.close_up = close_up_kernel;
    table.record_values = record_values_kernel;
    table.values_backward = values_backward_kernel;
    table.values_forward = values_forward_kernel;
    table.accumulate = accumulate;
}

}  // namespace edgegrad::EDGEGRAD_ISA
