// The pilot of light beams (boundary/specular/light_beams.h), and the cells that aim samples of edges.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "boundary/curves/candidates.h"
#include "engine/terms/found_edges.h"
#include "tasks/light_beams.h"
#include "tasks/render_options.h"
#include "util/double_vector.h"

namespace edgegrad {

// Cells of space with the points at which their beams begin or end.
class BeamGrid {
 public:
    BeamGridView view() const;
    // The flux of beams at a place.
    double flux(Vector p) const;
    double side() const { return side_; }

 private:
    friend class BeamGridBuilder;
    int64_t cell_of(Vector p) const;  // -1: outside

    std::vector<int32_t> slot_;
    std::vector<float> targets_;
    std::vector<double> flux_;  // by slot: the summed weight of the beams
    std::array<double, 3> low_{};
    double side_ = 1.0;
    std::array<int32_t, 3> count_{};
};

// Beams of about `samples` samples of a scene, where these edges are.
class LightBeams {
 public:
    // Null if there are none.
    static std::shared_ptr<const LightBeams> find(const SceneView& scene, const EdgeList& edges,
                                                  const RenderOptions& options, const FoundEdges& found,
                                                  double samples);

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
    const std::vector<uint8_t> bends_;  // materials that may have perfect lobes
};

}  // namespace edgegrad
