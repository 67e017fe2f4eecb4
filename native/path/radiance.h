// The picture: for each pixel the mean of L over its filter.
#pragma once

#include "path/path_tracer.h"

namespace edgegrad::EDGEGRAD_ISA {

static void radiance_kernel(const SceneView& scene, const ImageTask& task, Workspace& work, float* image) {
    int count = start_paths(scene, task, work);
    while (true) {
        count = shade_paths(scene, task, work, count);
        if (count == 0) break;
        trace_paths(scene, work, count);
    }
    accumulate(task, work, image);
}

}  // namespace edgegrad::EDGEGRAD_ISA
