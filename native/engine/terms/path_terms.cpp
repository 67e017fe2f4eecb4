#include "engine/terms/path_terms.h"

#include "scene/material_params.h"
#include "tasks/adjoint_task.h"
#include "tasks/horizon_task.h"
#include "tasks/seed_tags.h"

namespace edgegrad {
namespace {

// Paths per sample of the picture. A path of the horizon term costs twice as much as one of the interior term
// and has far less noise. A path of the rim term costs as much. Rims of gloss contribute little.
constexpr double kHorizonShare = 0.125, kRimShare = 0.5, kGlossRimShare = 0.125;

void sweep_paths(TermRun& run, AdjointTask sweep, DroppedSamples& lost) {
    sweep.dropped = &lost;
    if (run.is_forward())
        run.kernels.path_forward(run.scene, sweep, run.work().radiance);
    else
        run.kernels.path_backward(run.scene, sweep, run.adjoint);
}

}  // namespace

AdjointTask InteriorTerm::record(const TermRun& run, const ImageTask& task) const {
    Workspace& work = run.work();
    const AdjointTask sweep = recording_.begin(run, task);
    run.kernels.record(run.scene, task, work);
    const int32_t paths = task.pixel_count * task.samples;
    if (edge_on_) edge_on_->weigh(run.kernels, run.scene, paths, work);
    run.kernels.close_up(work, paths);
    AdjointWorkspace::release(work);
    return sweep;
}

ValueTask InteriorTerm::record_values(const TermRun& run, const ImageTask& task) const {
    Workspace& work = run.work();
    ValueTask sweep = run.memory.adjoint.value_task(task, work);
    sweep.tables = &run.tables;
    const Requested& requested = recording_.requested;
    ValueMemory& values = *sweep.values;
    constexpr uint64_t emission = Requested::columns(kEmission, kEmission + 3);
    const uint64_t columns =
        requested.any(FloatTable::kClosures) ? requested.span(FloatTable::kClosures).columns : 0;
    values.emission = (columns & emission) != 0;
    values.colors = (columns & ~emission) != 0;
    values.rows = requested.any(FloatTable::kLights);
    values.environment = requested.any(FloatTable::kEnvironment);
    values.requested = recording_.surfaces;
    values.requested.everywhere = values.emission || values.rows || values.environment;
    run.kernels.record_values(run.scene, task, work);
    AdjointWorkspace::release(work);
    return sweep;
}

void InteriorTerm::run_task(TermRun& run, const ImageTask& task, DroppedSamples& lost) {
    if (!values_alone_) return sweep_paths(run, record(run, task), lost);
    ValueTask sweep = record_values(run, task);
    sweep.dropped = &lost;
    if (run.is_forward())
        run.kernels.values_forward(run.scene, sweep, run.work().radiance);
    else
        run.kernels.values_backward(run.scene, sweep, run.adjoint);
}

RimTerm::RimTerm(const CameraView& camera, const RenderOptions& interior, Rims rims,
                 const PathRecording& recording)
    : PictureTerm(kInteriorTerm, Part::kRims,
                  ImagePlan(camera, interior.part(rims == Rims::kAll ? kRimShare : kGlossRimShare, kRimSeed),
                            kRecordedPaths)
                      .sharing()),
      recording_(recording) {}

void RimTerm::run_task(TermRun& run, const ImageTask& task, DroppedSamples& lost) {
    Workspace& work = run.work();
    const AdjointTask sweep = recording_.begin(run, task);
    work.vertices->rims = true;
    run.kernels.record(run.scene, task, work);
    run.kernels.close_up(work, task.pixel_count * task.samples);
    AdjointWorkspace::release(work);
    sweep_paths(run, sweep, lost);
}

HorizonTerm::HorizonTerm(const CameraView& camera, const RenderOptions& shadow, Part part)
    : PictureTerm(kShadowTerm, part, {camera, shadow.part(kHorizonShare, kHorizonSeed), kHorizonPaths}) {}

void HorizonTerm::run_task(TermRun& run, const ImageTask& task, DroppedSamples& lost) {
    const RenderOptions& options = plan_.options;
    const HorizonTask horizon{task, options.terms[kShadowTerm],
                              options.terms[kIndirectTerm] && options.max_depth > 2, &lost};
    if (run.is_forward())
        run.kernels.horizon_forward(run.scene, horizon, run.work(), run.view);
    else
        run.kernels.horizon_backward(run.scene, horizon, run.work(), run.adjoint, run.view);
}

}  // namespace edgegrad
