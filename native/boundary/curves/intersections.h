// Where surfaces pierce each other: the lines that pairs of triangles share, which no mesh has as an edge.
#pragma once

#include "boundary/curves/candidates.h"
#include "util/double_vector.h"

namespace edgegrad {

// One of the two surfaces of a line: a face and the instance that places it (-1: none does), or a light
// (LineSurface).
struct IntersectedFace {
    uint32_t face;
    int32_t instance = -1;
};

// Lines by number: their ends in the world (n, 2, 3), and the two faces of each with their instances.
struct Intersections {
    std::vector<float> ends;
    std::vector<uint32_t> faces;
    std::vector<int32_t> instances;

    int64_t size() const { return static_cast<int64_t>(faces.size() / 2); }
    void add(const Vector (&line)[2], IntersectedFace one, IntersectedFace other) {
        for (const Vector& e : line)
            for (double x : {e.x, e.y, e.z}) ends.push_back(static_cast<float>(x));
        for (const IntersectedFace& f : {one, other})
            faces.push_back(f.face), instances.push_back(f.instance);
    }
    // Lines [first, last) of others.
    void add(const Intersections& from, int64_t first, int64_t last) {
        const auto append = [&](auto& to, const auto& all, int64_t each) {
            to.insert(to.end(), all.begin() + each * first, all.begin() + each * last);
        };
        append(ends, from.ends, 6), append(faces, from.faces, 2), append(instances, from.instances, 2);
    }
    void add(const Intersections& from, int64_t k) { add(from, k, k + 1); }
    void add(const std::vector<Intersections>& parts) {
        for (const Intersections& part : parts) add(part, 0, part.size());
    }
};

// Meshes of more faces are not searched for places where they pierce themselves. Star-shaped ones of any size
// have none (boundary/meshes/star_shaped.h).
constexpr int32_t kSelfIntersectionFaces = 50'000;

// All crossings of meshes, and of the copies of instanced ones, that rays with one of `seers` (bits
// 1 << RayKind) meet, and of which one moves, or the camera does. Left out are faces that lie in one plane,
// or nearly (their line's speed has no bound), and edges that lie in a face: that is contact, which the edge
// itself covers.
Intersections find_intersections(const EdgeList& edges, const RequestedMotion& motion, int32_t seers);

// Of crossings that were found for more than what is asked, those of the latter.
Intersections moving_intersections(const SceneTables& tables, const RequestedMotion& motion,
                                   const Intersections& all);

// The edges of the scene and its crossings as further edges behind them.
class EdgesAndIntersections {
 public:
    EdgesAndIntersections(const SceneTables& tables, Intersections intersections);

    // `scene` with both; pointers are into this object.
    SceneView view(SceneView scene) const;
    // The crossings alone, by their length.
    Candidates intersections() const;
    // Adds the crossings' pieces in the picture to the edges'.
    void add_candidates(const CameraView& camera, Candidates& candidates) const;

 private:
    int32_t edge_count_;
    bool placed_;  // instances place some of the scene's meshes
    Intersections intersections_;
    std::vector<uint32_t> face_first_, faces_;
};

}  // namespace edgegrad
