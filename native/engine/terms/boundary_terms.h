// The boundary terms that a call computes: their candidates, samples and what samples are learned of.
#pragma once

#include <memory>
#include <vector>

#include "boundary/curves/candidates.h"
#include "boundary/curves/edge_tree.h"
#include "boundary/curves/intersections.h"
#include "boundary/curves/learned_weights.h"
#include "boundary/samples/sample_plan.h"
#include "engine/decisions.h"
#include "engine/drop_count.h"
#include "tasks/boundary_task.h"
#include "tasks/dropped_samples.h"

namespace edgegrad {

struct BoundaryTerm {
    SamplePlan plan;
    std::shared_ptr<const EdgesAndIntersections> lines;  // besides edges; null: none
    std::unique_ptr<DropCount> dropped;
    std::shared_ptr<const EdgeTree> tree;  // of the aimed estimator; else null
    float aimed;                           // which lobes are that one's (tasks/kernel_table.h)
    LearnedWeights* masses;                // null: the call neither uses nor learns any

    SceneView view(const SceneView& scene) const { return lines ? lines->view(scene) : scene; }
    BoundaryTask task(int pass, int64_t first, int64_t count, DroppedSamples& lost) {
        BoundaryTask t = plan.task(pass, first, count);
        t.dropped = &lost;
        t.aimed = aimed;
        if (tree) t.tree = tree->view();
        return t;
    }
};

// Those that `decided` computes, which is told what candidates they have; `learned`: with what earlier calls
// have learned, or null.
std::vector<BoundaryTerm> boundary_terms(const SceneView& scene, const EdgeList& edges,
                                         const RenderOptions& options, const RequestedMotion& motion,
                                         bool guided, float aimed, LearnedSampling* learned,
                                         Decisions& decided);

// Between the two passes over the terms' samples: the second ones' numbers. Returns the variance that is
// left, by what the first ones say; 0 if there are no second ones.
double guide_second_passes(std::vector<BoundaryTerm>& terms);

}  // namespace edgegrad
