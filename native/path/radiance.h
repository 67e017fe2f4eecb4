// The picture: for each pixel the mean of L over its filter.
#pragma once

#include "path/path_tracer.h"
#include "path/run.h"

namespace edgegrad::EDGEGRAD_ISA {

static void radiance_kernel(const SceneView& scene, const ImageTask& task, Workspace& work, float* image) {
    run_paths(scene, task, work, start_paths(scene, task, work));
    accumulate(task, work, image);
}

}  // namespace edgegrad::EDGEGRAD_ISA
