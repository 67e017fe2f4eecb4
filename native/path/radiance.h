// The picture: each pixel is the mean of L over the pixel filter.
#pragma once

#include "path/path_tracer.h"
#include "path/run.h"
#include "tasks/image_task.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// Adds the paths' values to the picture, in the order of the paths, so that the result does not depend on the
// packets' width.
static void accumulate(const ImageTask& task, const Workspace& work, float* image) {
    const float* value[3] = {work.radiance[0], work.radiance[1], work.radiance[2]};
    for (int pixel = 0; pixel < task.pixel_count; ++pixel) {
        float* out = image + 3 * static_cast<int64_t>(task.first_pixel + pixel);
        for (int c = 0; c < 3; ++c) {
            double sum = 0.0;
            for (int k = 0; k < task.samples; ++k) sum += static_cast<double>(value[c][k]);
            value[c] += task.samples;
            const auto rounded = static_cast<float>(sum);
            // The mean of the samples is finite where their sum may not be
            out[c] += rounded - rounded == 0.0f ? rounded * task.weight
                                                : static_cast<float>(sum * static_cast<double>(task.weight));
        }
    }
}

// Leaves the values of the paths in work.radiance, and adds them to the picture; null: there is none.
static void radiance_kernel(const SceneView& scene, const ImageTask& task, Workspace& work, float* image) {
    run_paths(scene, task, work, start_paths(scene, task, work));
    if (image) accumulate(task, work, image);
}

// Traces the same paths, or paths that sample rims, and records their vertices in work.vertices.
static void record_kernel(const SceneView& scene, const ImageTask& task, Workspace& work) {
    work.vertices->clear();
    run_paths(scene, task, work, start_paths(scene, task, work));
    if (work.vertices->rims) keep_rims(*work.vertices);
}

// Traces the same paths and records in work.values what derivatives by colours and strengths need.
static void record_values_kernel(const SceneView& scene, const ImageTask& task, Workspace& work) {
    work.values->count = 0;
    run_paths(scene, task, work, start_paths(scene, task, work));
}

}  // namespace edgegrad::EDGEGRAD_ISA
