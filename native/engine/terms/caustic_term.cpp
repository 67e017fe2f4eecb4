#include "engine/terms/caustic_term.h"

#include <algorithm>

#include "boundary/curves/segment_cells.h"
#include "engine/chain_sweeps.h"
#include "engine/terms/mirror_faces.h"
#include "tasks/seed_tags.h"

namespace edgegrad {
namespace {

class CausticTerm : public BoundaryTerm {
 public:
    // `mirrors`: faces by area, for samples of edges; null for those of outlines.
    CausticTerm(SamplePlan plan, SharedCandidates mirrors, std::shared_ptr<const LightBeams> beams)
        : BoundaryTerm(std::move(plan), {}, {}, nullptr, std::move(beams)), mirrors_(std::move(mirrors)) {}

 private:
    void run_samples(TermRun& run, int pass, int64_t first, int64_t count, DroppedSamples& lost) override;

    const SharedCandidates mirrors_;
};

// Adds samples of mirror_faces with cells on each face, or of edges with cells of directions. The term is
// multiplied by `factor`.
void add(BoundaryTerms& terms, const RenderOptions& options, BoundaryKind kind, const Candidates& found,
         const SharedCandidates& mirrors, const std::shared_ptr<const LightBeams>& beams, double samples,
         double factor) {
    if (found.size() == 0 || (mirrors && mirrors->size() == 0)) return;
    RenderOptions own = options;
    if (factor != 1.0) own.seed ^= kWindowSeed;
    const bool chains = kBoundaryTable[kind].chains(options.max_depth);
    SamplePlan plan(shared(over_directions(found, kDirectionSegments * samples, chains)), samples, samples,
                    own, kind, options.two_passes, static_cast<float>(factor));
    if (plan.total(0) > 0) terms.push_back(std::make_unique<CausticTerm>(std::move(plan), mirrors, beams));
}

void CausticTerm::run_samples(TermRun& run, int pass, int64_t first, int64_t count, DroppedSamples& lost) {
    if (run.is_forward()) std::fill_n(run.splats.x, count, kNowhere);
    BoundaryTask task = plan().task(pass, first, count);
    task.dropped = &lost;
    if (mirrors_)
        task.mirrors = {mirrors_->edge.data(), mirrors_->instance.data(), mirrors_->cumulative.data(),
                        mirrors_->size()};
    if (beams()) task.beams = beams()->towards_lights();
    ChainSweeps sweeps(run);
    const int found = run.kernels.caustics(run.scene, task, sweeps.crossings());
    if (found == 0) return;
    sweeps.set_count(found);
    BoundaryTask sides = task;
    sides.count = found;
    run.kernels.chain_sides(run.scene, sides, run.work(), sweeps.vertices(), sweeps.crossings(), found);
    run.kernels.weigh_caustics(run.scene, task, sweeps.crossings(), found);
    sweeps.differentiate();
}

}  // namespace

void add_caustic_outlines(BoundaryTerms& terms, const SceneView& scene, const SceneTables& tables,
                          const RenderOptions& options, double samples) {
    add(terms, options, kCausticOutline, mirror_faces(scene, tables, true), nullptr, nullptr, samples, 1.0);
}

void add_caustic_edges(BoundaryTerms& terms, const SceneView& scene, const SceneTables& tables,
                       const RenderOptions& options, const FoundEdges& found, double samples,
                       const std::shared_ptr<const LightBeams>& beams) {
    const SharedCandidates mirrors = shared(mirror_faces(scene, tables, false));
    found.each([&](const SharedCandidates& list, double part, double factor) {
        add(terms, options, kCausticEdge, beams ? beams->before_mirrors(scene, *list) : *list, mirrors, beams,
            part * samples, factor);
    });
}

}  // namespace edgegrad
