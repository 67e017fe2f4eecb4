#include "engine/terms/edge_on_term.h"
#include "tasks/adjoint_task.h"
#include "tasks/dropped_samples.h"
#include "tasks/kernel_table.h"
#include "tasks/splats.h"
#include "tasks/workspace_view.h"

#include <algorithm>
#include <cmath>

namespace edgegrad {
namespace {

// Of the first sample that was left out, its pixel in place of its number.
void tell_pixel(const CameraView& c, const AdjointTask& sweep) {
    DroppedSamples& d = *sweep.dropped;
    if (d.count == 0) return;
    const auto clamped = [](float a, int32_t size) {
        return std::clamp(static_cast<int64_t>(std::floor(a)), int64_t{0}, int64_t{size} - 1);
    };
    d.first =
        clamped(sweep.camera.y[d.first], c.height) * c.width + clamped(sweep.camera.x[d.first], c.width);
}

}  // namespace

std::optional<EdgeOnTerm> EdgeOnTerm::of(const SceneView& scene, const SceneTables& tables,
                                         const std::vector<int8_t>& sides, const RenderOptions& options,
                                         const RequestedMotion& motion, int threads) {
    EdgeOnList list = edge_on_faces(scene, tables, sides, options, motion, threads);
    if (list.total == 0) return std::nullopt;
    return EdgeOnTerm(std::move(list), options);
}

void EdgeOnTerm::record(const KernelTable& kernels, const SceneView& scene, int64_t first, int64_t count,
                        Workspace& work, const float* picture_adjoint, float* seen_adjoint) const {
    EdgeOnTask task{};
    task.faces = faces();
    task.face = list_.segment_face.data(), task.instance = list_.segment_instance.data();
    task.corners = list_.corners.data();
    task.cumulative = list_.cumulative.data();
    task.pieces = static_cast<int64_t>(list_.segment_face.size());
    task.first = first, task.count = count, task.total = list_.total;
    task.paths.pixel_count = task.paths.width = 1;
    task.paths.first_sample = static_cast<int32_t>(first);
    task.paths.samples = static_cast<int32_t>(count);
    task.paths.max_depth = options_.max_depth;
    task.paths.limits = options_.limits;
    task.paths.seed = options_.seed ^ 0x3c6ef372u;
    task.paths.one_stream = true;
    task.adjoint = picture_adjoint, task.seen_adjoint = seen_adjoint;
    kernels.record_edge_on(scene, task, work);
    AdjointWorkspace::release(work);
}

void EdgeOnTerm::forward(const KernelTable& kernels, const SceneView& scene, const AdjointTask& sweep,
                         int64_t first, Workspace& work, Splats splats) const {
    const int64_t count = sweep.image->pixel_count;
    record(kernels, scene, first, count, work, nullptr, nullptr);
    kernels.path_forward(scene, sweep, work.radiance);
    std::copy_n(sweep.camera.x, count, splats.x);
    std::copy_n(sweep.camera.y, count, splats.y);
    for (int c = 0; c < 3; ++c) std::copy_n(work.radiance[c], count, splats.value[c]);
    tell_pixel(scene.camera, sweep);
}

void EdgeOnTerm::backward(const KernelTable& kernels, const SceneView& scene, const AdjointTask& sweep,
                          int64_t first, Workspace& work, const float* picture_adjoint) const {
    const int64_t count = sweep.image->pixel_count;
    std::vector<float> seen(3 * static_cast<size_t>(count), 0.0f);
    record(kernels, scene, first, count, work, picture_adjoint, seen.data());
    kernels.path_backward(scene, sweep, seen.data());
    tell_pixel(scene.camera, sweep);
}

}  // namespace edgegrad
