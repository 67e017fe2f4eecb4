// Weights of edges by how much of the light that passes them reaches what is seen.
//
// The light that an edge point e hides from a place x falls with 1/|x - e|^2: it is the solid angle of x's
// surroundings as seen from e, in which directions are sampled. The weights of a search contain the length of
// an edge and the angle of its wedge, but not where it is. So the borders of a wide plane would take nearly
// all samples, though nothing of them is seen.
#pragma once

#include <memory>
#include <vector>

#include "boundary/curves/candidates.h"
#include "tasks/render_options.h"

namespace edgegrad {

class EdgeReach {
 public:
    // The reach of edges to a few places that the camera's paths meet; null if these meet too little.
    static std::shared_ptr<const EdgeReach> find(const SceneView& scene, const EdgeList& edges,
                                                 const RenderOptions& options);

    // The edges with these weights. A part of the sum keeps the weights of the search, for places that the
    // few paths have missed.
    Candidates weighted(const SceneView& scene, const Candidates& edges, int threads) const;

 private:
    // The mean over an edge's segment of sum over places of weight/(distance^2 + size^2).
    double of_segment(const EdgeEnds& ends) const;

    // By place: its coordinates, the squared size of the surroundings that it stands for, and its weight.
    std::vector<double> x_, y_, z_, size2_, weight_;
    double kept_ = 0.0;  // the part of the sum that keeps the weights of the search
};

}  // namespace edgegrad
