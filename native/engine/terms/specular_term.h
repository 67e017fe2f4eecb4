// The specular boundary term of a call: its scan lines, and the sweeps over the chains that they find.
#pragma once

#include <optional>

#include "boundary/meshes/surface_regions.h"
#include "boundary/samples/sample_plan.h"
#include "boundary/specular/scan_plan.h"
#include "engine/decisions.h"
#include "engine/derivative_tables.h"
#include "engine/workspace.h"
#include "tasks/adjoint_task.h"
#include "tasks/dropped_samples.h"
#include "tasks/image_task.h"
#include "tasks/kernel_table.h"
#include "tasks/splats.h"

namespace edgegrad {

// Whether what is asked for moves edges, or bends rays on their way.
bool moves_chains(const SceneTables& tables, const Requested& requested);

class SpecularTerm {
 public:
    // What `decided` computes of edges seen by mirrors and smooth glass; none where the camera sees neither.
    static std::optional<SpecularTerm> of(const SceneView& scene, const SceneTables& tables,
                                          const RenderOptions& options, bool guided, EdgeCache& kept,
                                          Decisions& decided);

    int passes() const { return plan_.passes(); }
    int64_t total(int pass) const { return plan_.total(pass); }
    int64_t total() const { return total(0) + (passes() > 1 ? total(1) : 0); }
    int64_t chunks(int pass) const { return (total(pass) + kBoundaryChunk - 1) / kBoundaryChunk; }
    // Between the passes.
    void guide() {
        if (passes() > 1) plan_.guide(sizes_);
    }

    // Segments [first, first + count) of a pass, count <= kBoundaryChunk: one splat for each. Chunks of the
    // first pass, by threads of their own, write down what the second one is guided by.
    void forward(const KernelTable& kernels, const SceneView& scene, int pass, int64_t first, int64_t count,
                 ThreadMemory& memory, const DifferentiableTables& tables, DerivativeView tangent,
                 Splats splats, DroppedSamples& dropped);
    void backward(const KernelTable& kernels, const SceneView& scene, int pass, int64_t first, int64_t count,
                  ThreadMemory& memory, const DifferentiableTables& tables, DerivativeView gradient,
                  const float* picture_adjoint, DroppedSamples& dropped);

 private:
    struct Parts {
        bool edges, lights, surfaces;  // as of a ScanTask
    };
    SpecularTerm(const SceneView& scene, const RenderOptions& options,
                 std::shared_ptr<const SurfaceRegions> regions, const FilmRectangle& film, Parts parts,
                 bool guided);
    // What finding crossings and what jumps there leaves.
    struct Found {
        int count;
        ImageTask image;
        AdjointTask sweep;
        DroppedSamples vertices;  // none: they are without light
    };
    void find(const KernelTable& kernels, const SceneView& scene, int pass, int64_t first, int64_t count,
              ThreadMemory& memory, Found& found, DroppedSamples& dropped);

    RenderOptions options_;
    std::shared_ptr<const SurfaceRegions> regions_;
    Parts parts_;
    ScanPlan plan_;
    std::vector<std::vector<IntersectionSize>> sizes_;  // by chunk of the first pass
    double shift_[2][kCameraFloats] = {};  // of the camera's floats: that of the picture by a pixel
};

}  // namespace edgegrad
