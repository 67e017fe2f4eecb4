// The number and the distribution of a boundary term's samples. There is one pass over the candidates'
// weights, or two passes, of which the first guides the second.
#pragma once

#include <memory>

#include "boundary/curves/candidates.h"
#include "boundary/curves/learned_weights.h"
#include "tasks/boundary_kind.h"
#include "tasks/boundary_task.h"
#include "tasks/render_options.h"

namespace edgegrad {

class SamplePlan {
 public:
    // A plan of one pass with `requested` samples, at most `most`. If `guided`, a fraction of these makes the
    // first pass, and the sizes of its samples distribute the others. Both passes estimate the whole term,
    // and the result is a weighted mean of both. The weights are constants, so the mean is unbiased although
    // the second pass depends on the first. The term is multiplied by `factor`.
    SamplePlan(std::shared_ptr<const Candidates> candidates, double requested, double most,
               const RenderOptions& options, BoundaryKind kind, bool guided, float factor = 1.0f);

    BoundaryKind kind() const { return kind_; }

    int passes() const { return guided_ ? 2 : 1; }
    // The samples of a pass. For the second pass this is an upper bound until guide() is called.
    int64_t total(int pass) const { return total_[pass]; }
    // Distributes the second pass. Call it between the passes.
    void guide();
    // Estimates the noise of the first pass: the standard deviation of one sample, from differences of
    // neighbours on the list, times the number of samples. It is that of the picture's sum for a unit motion
    // across each edge.
    double noise() const;
    // Reduces the second pass to a fraction of its samples.
    void thin(double part);

    // Records the samples' contributions to a gradient. teach() then updates the learned weights.
    void record();
    void teach(LearnedWeights& masses) const;

    BoundaryTask task(int pass, int64_t first, int64_t count);

 private:
    float scale(int pass) const;  // the weight of a pass' estimate
    SampleRecord view(int pass) const;

    std::shared_ptr<const Candidates> candidates_;
    RenderOptions options_;
    BoundaryKind kind_;
    bool guided_;
    float factor_;
    int64_t total_[2] = {0, 0};
    std::vector<float> score_;   // by sample of the first pass, one per share of the weight
    std::vector<double> guide_;  // (shares + 1)
    struct Record {
        int32_t shift = 0;
        std::vector<float> contribution, density, u;
        std::vector<int32_t> entry;
        std::vector<SegmentCell> cell;
    };
    mutable Record records_[2];  // by pass; empty: not recorded
};

}  // namespace edgegrad
