// The boundary terms that a call computes: their candidate edges, their samples, and learned sample weights.
#pragma once

#include <memory>
#include <vector>

#include "boundary/curves/candidates.h"
#include "boundary/curves/edge_tree.h"
#include "boundary/curves/intersections.h"
#include "boundary/curves/learned_weights.h"
#include "boundary/samples/beam_pilot.h"
#include "boundary/samples/sample_plan.h"
#include "engine/decisions/decisions.h"
#include "engine/terms/term.h"
#include "tasks/render_options.h"

namespace edgegrad {

class BoundaryTerm : public SampledTerm {
 public:
    // Where samples of a kind lie, beside the edges that their plan lists.
    struct Lines {
        std::shared_ptr<const EdgesAndIntersections> intersections;  // null: none
        // In which samples that start at the camera find edges; null: there are none, also of other kinds
        // that share the same shadows.
        std::shared_ptr<const EdgeTree> tree;
        float from_camera = 0.0f;   // BoundaryTask::from_camera
        bool shares_faces = false;  // BoundaryTask::shares_faces
    };
    // `learned`: sample weights of earlier calls, which the call uses and updates; null: none. `beams`: at
    // whose mirrors samples aim; null: at none.
    BoundaryTerm(SamplePlan plan, Lines lines, LearnedWeights* learned,
                 std::shared_ptr<const LightBeams> beams = nullptr)
        : SampledTerm(kBoundaryTable[plan.kind()].term(), kBoundaryTable[plan.kind()].part),
          plan_(std::move(plan)),
          lines_(std::move(lines)),
          learned_(learned),
          beams_(std::move(beams)) {}

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

 protected:
    void run_samples(TermRun& run, int pass, int64_t first, int64_t count, DroppedSamples& lost) override;

 private:
    SamplePlan plan_;
    const Lines lines_;
    LearnedWeights* const learned_;
    const std::shared_ptr<const LightBeams> beams_;
};
using BoundaryTerms = std::vector<std::unique_ptr<BoundaryTerm>>;

// The boundary terms that `decided` computes. Adds counts of their candidates to `decided`. `learned`: sample
// weights of earlier calls, or null.
BoundaryTerms boundary_terms(const SceneView& scene, const EdgeList& edges, const RenderOptions& options,
                             const RequestedMotion& motion, LearnedSampling* learned, Decisions& decided);

// Called between the two passes: sets the numbers of samples of the second pass. Returns the variance of the
// sum, estimated from the first pass; 0 if there is no second pass.
double guide_second_passes(const BoundaryTerms& terms);

}  // namespace edgegrad
