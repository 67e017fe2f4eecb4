// Terms whose samples are paths of the picture: the interior, rims of lobes, and horizons.
#pragma once

#include "engine/decisions/interior_rules.h"
#include "engine/terms/edge_on_term.h"
#include "engine/terms/path_recording.h"
#include "engine/terms/term.h"

namespace edgegrad {

// Derivatives of the radiance of paths, by sweeps over their recorded vertices.
class InteriorTerm : public PictureTerm {
 public:
    // `values_alone`: radiance is multilinear in the requested values (tasks/records/value_record.h).
    InteriorTerm(ImagePlan plan, const PathRecording& recording, bool values_alone)
        : PictureTerm(kInteriorTerm, Part::kInterior, std::move(plan)),
          recording_(recording),
          values_alone_(values_alone) {}

    void set_plan(ImagePlan plan) { plan_ = std::move(plan); }
    // Sets the samples by area with which its paths share their weight; null: none.
    void weigh_beside(const EdgeOnTerm* edge_on) { edge_on_ = edge_on; }
    // Traces and records a task's paths. Returns the task of sweeps over them.
    AdjointTask record(const TermRun& run, const ImageTask& task) const;

 private:
    void run_task(TermRun& run, const ImageTask& task, DroppedSamples& lost) override;
    ValueTask record_values(const TermRun& run, const ImageTask& task) const;

    const PathRecording& recording_;
    const bool values_alone_;
    const EdgeOnTerm* edge_on_ = nullptr;
};

// The term of rims of lobes (path/rim.h).
class RimTerm : public PictureTerm {
 public:
    RimTerm(const CameraView& camera, const RenderOptions& interior, Rims rims,
            const PathRecording& recording);

 private:
    void run_task(TermRun& run, const ImageTask& task, DroppedSamples& lost) override;

    const PathRecording& recording_;
};

// The term of horizons: light that the faces' own planes cut off (boundary/terms/horizon.h).
class HorizonTerm : public PictureTerm {
 public:
    // `part`: light of lights, or light of other surfaces only.
    HorizonTerm(const CameraView& camera, const RenderOptions& shadow, Part part);

 private:
    void run_task(TermRun& run, const ImageTask& task, DroppedSamples& lost) override;
};

}  // namespace edgegrad
