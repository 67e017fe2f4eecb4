// The terms of outlines of lights and of edges in caustics (boundary/specular/caustic_path.h).
#pragma once

#include "engine/terms/boundary_terms.h"

namespace edgegrad {

// The faces that may have perfect lobes, in place of edges, weighted by area. With `lit`, times the
// irradiance that the sized lights may have there.
Candidates mirror_faces(const SceneView& scene, const SceneTables& tables, bool lit);

// The least part of the samples of a second pass. Mirrors and glass magnify motions, which the size of a
// sample does not contain.
constexpr double least_of_caustics(BoundaryKind kind) {
    return kind == kCausticOutline || kind == kCausticEdge ? 0.25 : 0.0;
}

class CausticTerm : public BoundaryTerm {
 public:
    // Samples of mirror_faces with cells on each face, or of edges with cells of directions. The term is
    // multiplied by `factor`. Null: there is nothing to sample.
    static std::unique_ptr<CausticTerm> of(const SceneView& scene, const SceneTables& tables,
                                           const RenderOptions& options, BoundaryKind kind,
                                           const Candidates& found, double samples, double factor);

 private:
    // `mirrors`: faces by area, for samples of edges; null for those of outlines.
    CausticTerm(SamplePlan plan, std::shared_ptr<const Candidates> mirrors)
        : BoundaryTerm(std::move(plan), {}, {}, nullptr), mirrors_(std::move(mirrors)) {}
    void run_samples(TermRun& run, int pass, int64_t first, int64_t count, DroppedSamples& lost) override;

    const std::shared_ptr<const Candidates> mirrors_;
};

}  // namespace edgegrad
