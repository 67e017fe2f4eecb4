// The boundary terms that a call computes: their candidates, samples and what samples are learned of.
#pragma once

#include <memory>
#include <vector>

#include "boundary/curves/candidates.h"
#include "boundary/curves/edge_tree.h"
#include "boundary/curves/intersections.h"
#include "boundary/curves/learned_weights.h"
#include "boundary/samples/sample_plan.h"
#include "engine/terms/term.h"
#include "tasks/boundary_task.h"
#include "tasks/render_options.h"

namespace edgegrad {

class BoundaryTerm : public SampledTerm {
 public:
    // What samples of a kind lie on, beside the edges that their plan lists.
    struct Lines {
        std::shared_ptr<const EdgesAndIntersections> intersections;  // null: none
        std::shared_ptr<const EdgeTree> tree;                        // of samples that start at the camera
    };
    // `camera_sampled_alpha`: which lobes are left to samples that start at the camera, or are theirs;
    // `learned`: null: the call neither uses what was learned nor adds to it.
    BoundaryTerm(SamplePlan plan, Lines lines, float camera_sampled_alpha, LearnedWeights* learned)
        : SampledTerm(kBoundaryTable[plan.kind()].term(), kBoundaryTable[plan.kind()].part),
          plan_(std::move(plan)),
          lines_(std::move(lines)),
          camera_sampled_alpha_(camera_sampled_alpha),
          learned_(learned) {}

    SamplePlan& plan() { return plan_; }
    int passes() const override { return plan_.passes(); }
    int64_t samples(int pass) const override { return plan_.total(pass); }
    SceneView view(const SceneView& scene) const override {
        return lines_.intersections ? lines_.intersections->view(scene) : scene;
    }
    void record() override {
        if (learned_) plan_.record();
    }
    void teach() override {
        if (learned_) plan_.teach(*learned_);
    }

 private:
    void run_samples(TermRun& run, int pass, int64_t first, int64_t count, DroppedSamples& lost) override;

    SamplePlan plan_;
    const Lines lines_;
    const float camera_sampled_alpha_;
    LearnedWeights* const learned_;
};
using BoundaryTerms = std::vector<std::unique_ptr<BoundaryTerm>>;

// Those that `decided` computes, which is told what candidates they have; `learned`: with what earlier calls
// have learned, or null.
BoundaryTerms boundary_terms(const SceneView& scene, const EdgeList& edges, const RenderOptions& options,
                             const RequestedMotion& motion, LearnedSampling* learned, Decisions& decided);

// Between the two passes over the terms' samples: the second ones' numbers. Returns the variance that is
// left, by what the first ones say; 0 if there are no second ones.
double guide_second_passes(const BoundaryTerms& terms);

}  // namespace edgegrad
