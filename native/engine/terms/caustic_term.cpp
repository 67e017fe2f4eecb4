#include "engine/terms/caustic_term.h"

#include <algorithm>

#include "boundary/curves/segment_cells.h"
#include "boundary/meshes/surface_regions.h"
#include "engine/chain_sweeps.h"
#include "tasks/seed_tags.h"

namespace edgegrad {
namespace {

// What samples of edges need; those of outlines need nothing.
struct EdgeSurroundings {
    SharedCandidates mirrors;  // faces by area
    std::shared_ptr<const LightBeams> beams;
    std::shared_ptr<const SurfaceRegions> regions;
};

class CausticTerm : public BoundaryTerm {
 public:
    CausticTerm(SamplePlan plan, EdgeSurroundings about)
        : BoundaryTerm(std::move(plan), {}, {}, nullptr), about_(std::move(about)) {}

 private:
    void run_samples(TermRun& run, int pass, int64_t first, int64_t count, DroppedSamples& lost) override;

    const EdgeSurroundings about_;
};

// Adds samples of mirror_faces with cells on each face, or of edges with cells of directions. The term is
// multiplied by `factor`.
void add(BoundaryTerms& terms, const RenderOptions& options, BoundaryKind kind, const Candidates& found,
         const EdgeSurroundings& about, double samples, double factor) {
    if (found.size() == 0 || (about.mirrors && about.mirrors->size() == 0)) return;
    RenderOptions own = options;
    if (factor != 1.0) own.seed ^= kWindowSeed;
    const bool chains = kBoundaryTable[kind].chains(options.max_depth);
    SamplePlan plan(shared(over_directions(found, kDirectionSegments * samples, chains)), samples, samples,
                    own, kind, options.two_passes, static_cast<float>(factor));
    if (plan.total(0) > 0) terms.push_back(std::make_unique<CausticTerm>(std::move(plan), about));
}

void CausticTerm::run_samples(TermRun& run, int pass, int64_t first, int64_t count, DroppedSamples& lost) {
    if (run.is_forward()) std::fill_n(run.splats.x, count, kNowhere);
    BoundaryTask task = plan().task(pass, first, count);
    task.dropped = &lost;
    if (const Candidates* faces = about_.mirrors.get()) {
        task.mirrors = {faces->edge.data(), faces->instance.data(), faces->cumulative.data(), faces->size()};
        task.continues = about_.regions->continues.data();
    }
    if (about_.beams) task.beams = about_.beams->towards_lights();
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

void add_caustic_outlines(BoundaryTerms& terms, const RenderOptions& options, const Candidates& lit_mirrors,
                          double samples) {
    add(terms, options, kCausticOutline, lit_mirrors, {}, samples, 1.0);
}

void add_caustic_edges(BoundaryTerms& terms, const SceneView& scene, const EdgeList& edges,
                       const RenderOptions& options, const FoundEdges& found, double samples,
                       const SharedCandidates& mirrors, const std::shared_ptr<const LightBeams>& beams) {
    const EdgeSurroundings about{mirrors, beams,
                                 edges.kept.regions.get(true, [&] { return surface_regions(edges.tables); })};
    found.each([&](const SharedCandidates& list, double part, double factor) {
        add(terms, options, kCausticEdge, beams ? beams->before_mirrors(scene, *list) : *list, about,
            part * samples, factor);
    });
}

}  // namespace edgegrad
