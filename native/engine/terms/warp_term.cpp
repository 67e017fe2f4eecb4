#include "engine/terms/warp_term.h"

#include <algorithm>
#include <utility>

#include "boundary/samples/sample_plan.h"
#include "reparameterisation/picture_warp.h"
#include "scene/camera_row.h"
#include "tasks/adjoint_task.h"
#include "tasks/seed_tags.h"

namespace edgegrad {
namespace {

// Half of the distance of the two points whose difference is the derivative of a smooth filter, and of two
// points in pixels with a common border.
constexpr float kFilterStep = 0.02f, kBesideBorder = 0.25f;

// Memory of one chunk.
struct WarpMemory {
    std::vector<PictureWarp> warps, border_warps;
    std::vector<float> numbers;
    std::vector<int32_t> axis;
    WarpSamples samples{};

    WarpMemory(size_t count, bool box) {
        count += 2 * kMaxWidth;  // whole packets are written
        warps.resize(count), axis.resize(count);
        numbers.resize(15 * count, 0.0f);
        float* next = numbers.data();
        const auto take = [&] { return std::exchange(next, next + count); };
        WarpSamples& s = samples;
        s.weight = take();
        for (float*& v : s.value) v = take();
        for (auto& row : s.by_place)
            for (float*& v : row) v = take();
        for (float*& v : s.border) v = take();
        s.warp = s.border_warp = warps.data();
        s.axis = axis.data();
        std::copy(std::begin(s.value), std::end(s.value), s.border_value);
        s.border_weight = 1.0f / kFilterStep;
        s.border_step = kFilterStep;
        if (!box) return;
        border_warps.resize(count);
        s.border_warp = border_warps.data();
        for (float*& v : s.border_value) v = take();
        s.border_weight = 2.0f;  // one of two axes is chosen
        s.border_step = kBesideBorder;
    }
};

}  // namespace

WarpTerm::WarpTerm(SamplePlan plan, Lines lines, const RenderOptions& options, const CameraView& camera)
    : BoundaryTerm(std::move(plan), std::move(lines), {}, nullptr),
      options_(options),
      box_(!camera.filter),
      light_(4 * static_cast<size_t>(this->plan().passes() > 1 ? this->plan().total(0) : 0), 0.0f) {}

void WarpTerm::find_control() {
    double weight = 0.0, sum[3] = {};
    for (size_t k = 0; k < light_.size(); k += 4) {
        weight += static_cast<double>(light_[k]);
        for (size_t c = 0; c < 3; ++c) sum[c] += static_cast<double>(light_[k + 1 + c]);
    }
    for (int c = 0; c < 3 && weight > 0.0; ++c) control_[c] = static_cast<float>(sum[c] / weight);
}

void WarpTerm::differentiate(const TermRun& run, AdjointTask& sweep, int64_t count,
                             const WarpSamples& samples) const {
    for (int k = 0; k < 2; ++k) {
        // If the principal point moves, the picture does
        double shift[kCameraFloats] = {};
        shift[kCameraPrincipal + k] = -1.0;
        DifferentiableTables camera;
        camera.add(run.scene.camera.position, kCameraFloats, 0, kCameraFloats, 1, 1, nullptr, shift);
        sweep.tables = &camera;
        float* const(&to)[3] = samples.by_place[k];
        for (float* v : to) std::fill_n(v, count, 0.0f);
        if (sweep.vertices->count > 0) run.kernels.path_forward(run.scene, sweep, to);
    }
    if (sweep.vertices->count == 0) return;
    // Recorded light is evaluated by sweeps; paths hold only that of lights which they meet
    for (int c = 0; c < 3; ++c)
        for (int64_t i = 0; i < count; ++i) samples.value[c][i] += sweep.incoming[c][i];
}

void WarpTerm::run_samples(TermRun& run, int pass, int64_t first, int64_t count, DroppedSamples& lost) {
    WarpMemory memory(static_cast<size_t>(count), box_);
    WarpTask task{};
    task.of = memory.samples;
    task.samples = plan().task(pass, first, count);
    task.samples.dropped = &lost;
    if (pass > 0) {
        std::call_once(found_, [this] { find_control(); });
        std::copy_n(control_, 3, task.control);
    }
    ImageTask& paths = task.paths;
    paths.pixel_count = paths.width = 1;
    paths.first_sample = static_cast<int32_t>(first);
    paths.samples = static_cast<int32_t>(count);
    paths.max_depth = options_.max_depth;
    paths.limits = options_.limits;
    paths.seed = task.samples.seed ^ kWarpSeed;
    paths.one_stream = true;
    paths.weight = 1.0f;
    Workspace& work = run.work();
    DroppedSamples vertices;
    AdjointTask sweep = run.memory.adjoint.task(paths, work);
    sweep.geometry = sweep.camera_moves = true;
    sweep.dropped = &vertices;
    run.kernels.warp_record(view(run.scene), task, work);
    run.kernels.close_up(work, paths.samples);
    AdjointWorkspace::release(work);
    differentiate(run, sweep, count, task.of);
    lost.count += vertices.count;
    if (box_) run.kernels.warp_borders(view(run.scene), task, work);
    if (pass == 0 && !light_.empty())
        for (int64_t i = 0; i < count; ++i) {
            float* out = &light_[4 * static_cast<size_t>(first + i)];
            const bool within = task.of.warp[i].count > 0;
            out[0] = within ? task.of.weight[i] : 0.0f;
            for (int c = 0; c < 3; ++c) out[1 + c] = out[0] * task.of.value[c][i];
        }
    if (run.is_forward())
        run.kernels.warp_forward(run.scene, task, work, run.view, run.splats);
    else
        run.kernels.warp_backward(run.scene, task, work, run.adjoint, run.view);
}

}  // namespace edgegrad
