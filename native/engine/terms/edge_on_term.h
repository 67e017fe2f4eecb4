// Camera samples by area of the faces that the camera sees nearly edge-on, beside the interior term's own
// (path/edge_on.h): the sweeps over their paths.
#pragma once

#include <memory>

#include "engine/terms/edge_on_faces.h"
#include "engine/terms/path_recording.h"
#include "engine/terms/term.h"
#include "tasks/edge_on_task.h"

namespace edgegrad {

class EdgeOnTerm : public SampledTerm {
 public:
    // Null where the camera sees no face edge-on on which its rays slide. `sides`: boundary/meshes/solids.h;
    // `options`: those of the interior term.
    static std::unique_ptr<EdgeOnTerm> of(const SceneView& scene, const SceneTables& tables,
                                          const std::vector<int8_t>& sides, const RenderOptions& options,
                                          const RequestedMotion& motion, const PathRecording& recording,
                                          int threads);

    int64_t samples(int) const override { return list_.total; }
    bool drops_by_pixel() const override { return true; }
    // What so many recorded paths of the picture count for beside those by area.
    void weigh(const KernelTable& kernels, const SceneView& scene, int32_t paths, Workspace& work) const {
        kernels.weigh_edge_on(scene, faces(), paths, false, work);
    }

 private:
    EdgeOnTerm(EdgeOnList list, const RenderOptions& options, const PathRecording& recording)
        : SampledTerm(kInteriorTerm, Part::kEdgeOn),
          list_(std::move(list)),
          options_(options),
          recording_(recording) {}
    EdgeOnFaces faces() const {
        return {list_.face_first.data(), list_.entry_instance.data(), list_.entry_density.data(),
                static_cast<float>(options_.samples)};
    }
    void run_samples(TermRun& run, int pass, int64_t first, int64_t count, DroppedSamples& lost) override;
    EdgeOnTask task(const TermRun& run, int64_t first, int64_t count, float* seen_adjoint) const;

    const EdgeOnList list_;
    const RenderOptions options_;
    const PathRecording& recording_;
};

}  // namespace edgegrad
