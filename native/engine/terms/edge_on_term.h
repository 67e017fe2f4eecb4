// Sweeps over camera samples by area of faces that are seen nearly edge-on (path/edge_on.h), which complement
// the samples of the interior term.
#pragma once

#include <memory>

#include "engine/terms/edge_on_faces.h"
#include "engine/terms/path_recording.h"
#include "engine/terms/term.h"
#include "tasks/edge_on_task.h"

namespace edgegrad {

class EdgeOnTerm : public SampledTerm {
 public:
    // Null if no face is seen edge-on, or no hit moves along such a face. `sides`: boundary/meshes/solids.h;
    // `options`: those of the interior term.
    static std::unique_ptr<EdgeOnTerm> of(const SceneView& scene, const SceneTables& tables,
                                          const std::vector<int8_t>& sides, const RenderOptions& options,
                                          const RequestedMotion& motion, const PathRecording& recording,
                                          int threads);

    int64_t samples(int) const override { return list_.total; }
    bool drops_by_pixel() const override { return true; }
    // Multiplies `paths` recorded paths of the picture by their weight in the balance with samples by area.
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
