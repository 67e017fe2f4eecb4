// Traces paths from their first hits to their ends.
#pragma once

#include "tasks/image_task.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// Traces the `count` paths in work.paths, whose rays have met work.hits (face -1: none). Adds their radiance
// to work.radiance, by path. Compiled once, in kernels/path_kernels.cpp.
void run_paths(const SceneView& scene, const ImageTask& task, Workspace& work, int count);

}  // namespace edgegrad::EDGEGRAD_ISA
