#include "engine/terms/edge_on_term.h"
#include "tasks/adjoint_task.h"
#include "tasks/dropped_samples.h"
#include "tasks/seed_tags.h"
#include "tasks/workspace_view.h"

#include <algorithm>
#include <cmath>

namespace edgegrad {
namespace {

// Replaces the number of the first sample that was left out by its pixel.
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

std::unique_ptr<EdgeOnTerm> EdgeOnTerm::of(const SceneView& scene, const SceneTables& tables,
                                           const std::vector<int8_t>& sides, const RenderOptions& options,
                                           const RequestedMotion& motion, const PathRecording& recording,
                                           int threads) {
    EdgeOnList list = edge_on_faces(scene, tables, sides, options, motion, threads);
    if (list.total == 0) return nullptr;
    return std::unique_ptr<EdgeOnTerm>(new EdgeOnTerm(std::move(list), options, recording));
}

EdgeOnTask EdgeOnTerm::task(const TermRun& run, int64_t first, int64_t count, float* seen_adjoint) const {
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
    task.paths.seed = options_.seed ^ kEdgeOnSeed;
    task.paths.one_stream = true;
    task.adjoint = run.adjoint, task.seen_adjoint = seen_adjoint;
    return task;
}

void EdgeOnTerm::run_samples(TermRun& run, int, int64_t first, int64_t count, DroppedSamples& lost) {
    Workspace& work = run.work();
    // Sweeps treat each sample as a pixel with one path and its own adjoint.
    ImageTask image{};
    image.pixel_count = static_cast<int32_t>(count);
    image.samples = 1;
    image.weight = 1.0f;
    std::vector<float> seen(run.is_forward() ? 0 : 3 * static_cast<size_t>(count), 0.0f);
    AdjointTask sweep = recording_.begin(run, image);
    sweep.dropped = &lost;
    run.kernels.record_edge_on(run.scene, task(run, first, count, run.is_forward() ? nullptr : seen.data()),
                               work);
    AdjointWorkspace::release(work);
    if (run.is_forward()) {
        run.kernels.path_forward(run.scene, sweep, work.radiance);
        std::copy_n(sweep.camera.x, count, run.splats.x);
        std::copy_n(sweep.camera.y, count, run.splats.y);
        for (int c = 0; c < 3; ++c) std::copy_n(work.radiance[c], count, run.splats.value[c]);
    } else {
        run.kernels.path_backward(run.scene, sweep, seen.data());
    }
    tell_pixel(run.scene.camera, sweep);
}

}  // namespace edgegrad
