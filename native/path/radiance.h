// The picture: for each pixel the mean of L over its unit square.
#pragma once

#include "path/stream.h"

namespace edgegrad::EDGEGRAD_ISA {

static void radiance_kernel(const SceneView& scene, const ImageTask& task, Workspace& work, float* image) {
    const int queued = trace_camera_paths(scene, task, splat3(scene.environment), work);
    for (int at = 0; at < queued; at += W) {
        const QueuedHit q = load_hit(scene, task, at, queued, work);
        LightRandom random{};
        if (task.max_depth >= 2) random = light_random(scene, q.index.stream, q.index.sample);
        scatter_radiance(work, q, outgoing_radiance(scene, q.point, task.max_depth, random));
    }
    accumulate(task, work, image);
}

}  // namespace edgegrad::EDGEGRAD_ISA
