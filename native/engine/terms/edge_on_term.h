// Camera samples by area of the faces that the camera sees nearly edge-on, beside the interior term's own
// (path/edge_on.h): the sweeps over their paths.
#pragma once

#include <optional>

#include "boundary/samples/sample_plan.h"
#include "engine/derivative_tables.h"
#include "engine/terms/edge_on_faces.h"
#include "engine/workspace.h"
#include "tasks/adjoint_task.h"
#include "tasks/edge_on_task.h"
#include "tasks/image_task.h"
#include "tasks/kernel_table.h"
#include "tasks/splats.h"
#include "tasks/workspace_view.h"

namespace edgegrad {

class EdgeOnTerm {
 public:
    // None where the camera sees no face edge-on on which its rays slide. `sides`: boundary/meshes/solids.h;
    // `options`: those of the interior term.
    static std::optional<EdgeOnTerm> of(const SceneView& scene, const SceneTables& tables,
                                        const std::vector<int8_t>& sides, const RenderOptions& options,
                                        const RequestedMotion& motion, int threads);

    int64_t total() const { return list_.total; }
    int64_t chunks() const { return (list_.total + kBoundaryChunk - 1) / kBoundaryChunk; }

    // What so many recorded paths of the picture count for beside those by area.
    void weigh(const KernelTable& kernels, const SceneView& scene, int32_t paths, Workspace& work) const {
        kernels.weigh_edge_on(scene, faces(), paths, false, work);
    }
    // Of `count` samples, each of which is a pixel of one path: what sweeps over them are for.
    static ImageTask image(int64_t count) {
        ImageTask image{};
        image.pixel_count = static_cast<int32_t>(count);
        image.samples = 1;
        image.weight = 1.0f;
        return image;
    }
    // Samples [first, first + count), count <= kBoundaryChunk, for a sweep over their image that records into
    // work.vertices: one splat for each.
    void forward(const KernelTable& kernels, const SceneView& scene, const AdjointTask& sweep, int64_t first,
                 Workspace& work, Splats splats) const;
    void backward(const KernelTable& kernels, const SceneView& scene, const AdjointTask& sweep, int64_t first,
                  Workspace& work, const float* picture_adjoint) const;

 private:
    EdgeOnTerm(EdgeOnList list, const RenderOptions& options) : list_(std::move(list)), options_(options) {}
    EdgeOnFaces faces() const {
        return {list_.face_first.data(), list_.entry_instance.data(), list_.entry_density.data(),
                static_cast<float>(options_.samples)};
    }
    void record(const KernelTable& kernels, const SceneView& scene, int64_t first, int64_t count,
                Workspace& work, const float* picture_adjoint, float* seen_adjoint) const;

    EdgeOnList list_;
    RenderOptions options_;
};

}  // namespace edgegrad
