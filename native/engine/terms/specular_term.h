// The specular boundary term of a call: its scan lines, and the sweeps over the chains that they find.
#pragma once

#include <memory>

#include "boundary/curves/edge_cache.h"
#include "boundary/meshes/surface_regions.h"
#include "boundary/specular/scan_plan.h"
#include "engine/decisions/decisions.h"
#include "engine/derivative_tables.h"
#include "engine/terms/term.h"
#include "tasks/render_options.h"

namespace edgegrad {

// Whether the requested parameters move edges, or change the directions of a chain's rays.
bool moves_chains(const SceneTables& tables, const Requested& requested);
// Whether they do so by shading normals or by values of mirrors and smooth glass.
bool bends_chains(const SceneTables& tables, const Requested& requested);

class ChainSweeps;

class SpecularTerm : public SampledTerm {
 public:
    // The parts that `decided` computes; null if the camera sees no mirrors and no smooth glass.
    static std::unique_ptr<SpecularTerm> of(const SceneView& scene, const SceneTables& tables,
                                            const RenderOptions& options, EdgeCache& kept,
                                            Decisions& decided);

    int passes() const override { return plan_.passes(); }
    int64_t samples(int pass) const override { return plan_.total(pass); }
    // Called between the passes.
    void guide() {
        if (passes() > 1) plan_.guide(sizes_);
    }

 private:
    struct Parts {
        bool edges, lights, surfaces, outlines;  // as of a ScanTask
    };
    SpecularTerm(const SceneView& scene, const RenderOptions& options,
                 std::shared_ptr<const SurfaceRegions> regions, const FilmRectangle& film, Parts parts);
    void run_samples(TermRun& run, int pass, int64_t first, int64_t count, DroppedSamples& lost) override;
    void note_sizes(int64_t first, const ChainSweeps& sweeps);

    const RenderOptions options_;
    std::shared_ptr<const SurfaceRegions> regions_;
    Parts parts_;
    ScanPlan plan_;
    std::vector<std::vector<IntersectionSize>> sizes_;  // by chunk of the first pass
    double shift_[2][kCameraFloats] = {};  // change of the camera's floats that shifts the picture by a pixel
};

}  // namespace edgegrad
