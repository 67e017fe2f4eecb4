// How many samples a boundary term takes, and where: in one pass over the candidates' mass, or in two, of
// which the first says where the second is worth its while.
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
    // One pass of `wanted` samples, at most `most`; `guided`: a part of them, then the others by the
    // sizes that those had. Both passes estimate the whole term, and their weighted mean is the
    // result: the weights are fixed, so that it stays unbiased though the second pass depends on the first.
    SamplePlan(std::shared_ptr<const Candidates> candidates, double requested, double most,
               const RenderOptions& options, BoundaryKind kind, bool guided);

    BoundaryKind kind() const { return kind_; }

    int passes() const { return guided_ ? 2 : 1; }
    // Samples of a pass; of the second one before `guide` the most that it may take.
    int64_t total(int pass) const { return total_[pass]; }
    // Between the passes.
    void guide();
    // Noise of a sample of the first pass: the root of its variance among neighbours on the list, times the
    // number of samples, for a picture's sum and a motion of one unit across every edge.
    double noise() const;
    // Takes this part of the second pass' samples only.
    void thin(double part);

    // Records what samples are worth to a gradient; after it, teaches that.
    void record();
    void teach(LearnedWeights& masses) const;

    BoundaryTask task(int pass, int64_t first, int64_t count);

 private:
    float scale(int pass) const;  // what a pass' samples count for
    SampleRecord view(int pass) const;

    std::shared_ptr<const Candidates> candidates_;
    RenderOptions options_;
    BoundaryKind kind_;
    bool guided_;
    int64_t total_[2] = {0, 0};
    std::vector<float> score_;   // by sample of the first pass, each in a share of its own
    std::vector<double> guide_;  // (shares + 1)
    struct Record {
        int32_t shift = 0;
        std::vector<float> contribution, density, u;
        std::vector<int32_t> entry;
        std::vector<SegmentCell> cell;
    };
    mutable Record records_[2];  // by pass; empty: nothing is learned
};

}  // namespace edgegrad
