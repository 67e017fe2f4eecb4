// The term of the warped picture (boundary/terms/warped_picture.h).
#pragma once

#include <mutex>

#include "engine/terms/boundary_terms.h"
#include "reparameterisation/warp_task.h"

namespace edgegrad {

class WarpTerm : public BoundaryTerm {
 public:
    WarpTerm(SamplePlan plan, Lines lines, const RenderOptions& options, const CameraView& camera);

    int32_t splats_of_sample() const override { return kWarpSplats; }

 private:
    void run_samples(TermRun& run, int pass, int64_t first, int64_t count, DroppedSamples& lost) override;
    // Evaluates the recorded paths and their derivatives by their places in the picture.
    void differentiate(const TermRun& run, AdjointTask& sweep, int64_t count,
                       const WarpSamples& samples) const;
    // Mean radiance of the first pass, of which the second one is independent.
    void find_control();

    const RenderOptions options_;
    const bool box_;            // the pixel filter
    std::vector<float> light_;  // by sample of the first pass: weight, color times weight
    std::once_flag found_;
    float control_[3] = {};
};

}  // namespace edgegrad
