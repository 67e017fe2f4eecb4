// Where surfaces pierce each other: the lines that pairs of triangles share, which no mesh has as an edge.
#pragma once

#include "boundary/candidates.h"

namespace edgegrad {

// Lines by number: their ends (n, 2, 3), and the two faces of each, or a face and a light (kLightOfTable).
struct Crossings {
    std::vector<float> ends;
    std::vector<uint32_t> faces;

    int64_t size() const { return static_cast<int64_t>(faces.size() / 2); }
    // Line k of others.
    void add(const Crossings& from, size_t k) {
        const auto line = from.ends.begin() + static_cast<ptrdiff_t>(6 * k);
        const auto pair = from.faces.begin() + static_cast<ptrdiff_t>(2 * k);
        ends.insert(ends.end(), line, line + 6);
        faces.insert(faces.end(), pair, pair + 2);
    }
};

// Meshes of more faces are not searched for places where they pierce themselves.
constexpr int32_t kSelfCrossingFaces = 50'000;

// All crossings of meshes that rays with one of `seers` (bits 1 << RayKind) meet, and of which one moves, or
// the camera does. Left out are faces
// that lie in one plane, or nearly (their line's speed has no bound), and edges that lie in a face: that is
// contact, which the edge itself covers. Instances are left out.
Crossings find_crossings(const SceneTables& tables, const Asked& asked, int32_t seers, int threads);

// Of crossings that were found for more than what is asked, those of the latter.
Crossings moving_crossings(const SceneTables& tables, const Asked& asked, const Crossings& all);

// The edges of the scene and its crossings as further edges behind them.
class EdgesAndCrossings {
 public:
    EdgesAndCrossings(const SceneTables& tables, Crossings crossings);

    // `scene` with both; pointers are into this object.
    SceneView view(SceneView scene) const;
    // The crossings alone, by their length.
    Candidates crossings() const;
    // Adds the crossings' pieces in the picture to the edges'.
    void add_candidates(const CameraView& camera, Candidates& candidates) const;

 private:
    int32_t edge_count_;
    Crossings crossings_;
    std::vector<uint32_t> face_first_, faces_;
};

}  // namespace edgegrad
