// Weights of edges by how much of the light that passes them reaches what is seen.
//
// Light passes a point e of an edge in directions about the edge, and 1/|x - e|^2 is the part of these that
// meets a place x and its surroundings. Light of a lamp or a sun passes e in one direction: x and its
// surroundings meet it if the ray from e passes x closely. The weights of a search contain the length of an
// edge, the angle of its wedge and the power of the light, but not where the shadow falls. So the borders of
// a wide plane would take nearly all samples, though nothing of them is seen.
#pragma once

#include <memory>
#include <vector>

#include "boundary/curves/candidates.h"
#include "scene/lights/light_view.h"
#include "tasks/boundary_task.h"
#include "tasks/render_options.h"

namespace edgegrad {

class EdgeReach {
 public:
    // The reach of edges to a few places that the camera's paths meet; null if these meet too little.
    static std::shared_ptr<const EdgeReach> find(const SceneView& scene, const EdgeList& edges,
                                                 const RenderOptions& options);

    // The edges weighted for light in all directions. A part of the sum keeps the weights of the search, for
    // places that the few paths have missed.
    Candidates weighted(const SceneView& scene, const EdgeList& list, const Candidates& edges) const;
    // The same for the light of suns and lamps.
    Candidates weighted_for_lights(const SceneView& scene, const EdgeList& list,
                                   const Candidates& edges) const;
    // Whether the latter is worth while. The weights of edges near lamps contain their distance, and many
    // lights take time.
    static bool serves(const LightView& lights);

 private:
    // The edges weighted for light of `task`, a part `kept` of the sum as before.
    Candidates weighted_by(EdgeReachTask task, const SceneView& scene, const EdgeList& list,
                           const Candidates& edges, double kept) const;

    // By place: its position, the squared size of the surroundings that it stands for, and its weight.
    std::vector<float> position_[3], size2_, weight_;
    double kept_ = 0.0;  // the part of the sum that keeps the weights of the search
};

}  // namespace edgegrad
