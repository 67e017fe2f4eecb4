// The specular boundary term of a call: its scan lines, and the sweeps over the chains that they find.
#pragma once

#include <optional>

#include "boundary/boundary_plan.h"
#include "boundary/specular_bounds.h"
#include "boundary/surface_regions.h"
#include "derivative_tables.h"
#include "workspace.h"

namespace edgegrad {

// Whether what is asked for moves edges, or bends rays on their way.
bool moves_chains(const SceneTables& tables, const Wanted& wanted);

class SpecularTerm {
 public:
    // None where no surface is a mirror or smooth glass, or nothing asked for moves rays or edges.
    static std::optional<SpecularTerm> of(const SceneView& scene, const SceneTables& tables,
                                          const RenderOptions& options, const Wanted& wanted,
                                          KeptEdges& kept);

    int64_t total() const { return total_; }
    int64_t chunks() const { return (total_ + kBoundaryChunk - 1) / kBoundaryChunk; }

    // Segments [first, first + count), count <= kBoundaryChunk: one splat for each.
    void forward(const KernelTable& kernels, const SceneView& scene, int64_t first, int64_t count,
                 Workspace& work, AdjointWorkspace& adjoint, ChainWorkspace& chains,
                 const DifferentiableTables& tables, DerivativeView tangent, Splats splats,
                 DroppedSamples& dropped) const;
    void backward(const KernelTable& kernels, const SceneView& scene, int64_t first, int64_t count,
                  Workspace& work, AdjointWorkspace& adjoint, ChainWorkspace& chains,
                  const DifferentiableTables& tables, DerivativeView gradient, const float* picture_adjoint,
                  DroppedSamples& dropped) const;

 private:
    struct Parts {
        bool edges, lights, surfaces;  // as of a ScanTask
    };
    SpecularTerm(const SceneView& scene, const RenderOptions& options,
                 std::shared_ptr<const SurfaceRegions> regions, const FilmRectangle& film, Parts parts);
    // What finding crossings and what jumps there leaves.
    struct Found {
        int count;
        ImageTask image;
        AdjointTask sweep;
        DroppedSamples vertices;  // none: they are without light
    };
    void find(const KernelTable& kernels, const SceneView& scene, int64_t first, int64_t count,
              Workspace& work, AdjointWorkspace& adjoint, ChainWorkspace& chains, Found& found,
              DroppedSamples& dropped) const;

    RenderOptions options_;
    std::shared_ptr<const SurfaceRegions> regions_;
    ScanTask scan_{};
    int64_t total_ = 0;
    double shift_[2][kCameraFloats] = {};  // of the camera's floats: that of the picture by a pixel
};

}  // namespace edgegrad
