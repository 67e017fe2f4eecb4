// Candidate edges of the primary boundary: which edges can carry a jump the camera sees, clipped to
// the view frustum, with the mass by which they are sampled.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/view.h"

namespace edgegrad {

// Pieces of edges inside the frustum; u is the position along the edge, 0 at its first vertex.
struct Candidates {
    std::vector<int32_t> edge;
    std::vector<float> u0, u1;
    std::vector<double> cumulative{0.0};  // mass up to each piece, pixels

    int64_t size() const { return static_cast<int64_t>(edge.size()); }
    double mass() const { return cumulative.back(); }
};

// All edges of a scene, in the order of meshes.
struct EdgeList {
    int64_t count;
    const int8_t* solid_side;  // by mesh (boundary/solids.h)
    int threads;
};

// Edges that the camera sees, of moving meshes (static ones under a static camera sweep over nothing). Only a
// flat pair of faces can't carry a jump: two faces in one plane, of one orientation and one material.
// Silhouettes, open borders, creases between flat faces and material borders are one case (derivations A3).
Candidates primary_candidates(const SceneView& scene, const EdgeList& edges);

// Edges that may hide light from a surface: silhouettes as seen from some point of the finite
// emitters, or (towards the environment) all that are not flat. Of all meshes: what moves may also
// be the surface or the light.
Candidates shadow_candidates(const SceneView& scene, const EdgeList& edges, bool environment);

}  // namespace edgegrad
