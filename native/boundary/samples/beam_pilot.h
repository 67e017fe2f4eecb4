// The pilot of light beams (boundary/caustics/traced_beams.h), which aims samples of edges and weights these.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "boundary/curves/candidates.h"
#include "boundary/samples/beam_grid.h"
#include "tasks/render_options.h"

namespace edgegrad {

class LightBeams {
 public:
    using SharedCandidates = std::shared_ptr<const Candidates>;
    // Beams of a pilot of about `samples` samples on the faces of `mirrors`, an equal part on each list, in
    // the cells of the candidates `found`; null if there are none. `bends`: 1 for materials that may have
    // perfect lobes, else 0.
    static std::shared_ptr<const LightBeams> find(const SceneView& scene, const EdgeList& edges,
                                                  const RenderOptions& options,
                                                  const std::array<SharedCandidates, 2>& mirrors,
                                                  const std::vector<SharedCandidates>& found,
                                                  std::vector<uint8_t> bends, double samples);

    // For edges between lights and m_K, and between m_1 and what it lights: where directions from them aim,
    // and the edges, cut into parts of more weight where beams pass.
    BeamGridView towards_lights() const { return towards_lights_.view(); }
    BeamGridView towards_mirrors() const { return towards_mirrors_.view(); }
    Candidates before_mirrors(const SceneView& scene, const Candidates& edges) const {
        return weighted(towards_lights_, 0.5, scene, edges);
    }
    Candidates behind_mirrors(const SceneView& scene, const Candidates& edges) const {
        return weighted(towards_mirrors_, 0.25, scene, edges);
    }

 private:
    LightBeams(BeamGrid towards_lights, BeamGrid towards_mirrors, std::vector<uint8_t> bends)
        : towards_lights_(std::move(towards_lights)),
          towards_mirrors_(std::move(towards_mirrors)),
          bends_(std::move(bends)) {}
    // `by_flux`: the part of the weight that goes with the beams. The rest remains as it is, since light that
    // surfaces scatter makes no beams.
    Candidates weighted(const BeamGrid& grid, double by_flux, const SceneView& scene,
                        const Candidates& edges) const;

    const BeamGrid towards_lights_, towards_mirrors_;
    const std::vector<uint8_t> bends_;
};

}  // namespace edgegrad
