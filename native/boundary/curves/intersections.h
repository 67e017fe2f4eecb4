// Intersections of surfaces, and other curves that are sampled as they are: the lines that pairs of triangles
// share and that are no edge of any mesh.
#pragma once

#include <array>
#include <vector>

#include "boundary/curves/candidates.h"
#include "util/double_vector.h"

namespace edgegrad {

// One of the two surfaces of a line: a face with the instance that places it (-1: not instanced), or a light
// (kLightOfTable).
struct IntersectedFace {
    uint32_t face;
    int32_t instance = -1;
};

// The ends of each line in the world (n, 2, 3), and its two faces with their instances.
struct Intersections {
    std::vector<float> ends;
    std::vector<uint32_t> faces;
    std::vector<int32_t> instances;
    // By line, or empty (boundary/fields/field_curves.h): the patches of fields that take the place of lines,
    // and weights, which are else the lines' lengths.
    std::vector<FieldPatch> patches;
    // By line, or empty: the point of the lens (x, y) from which it is seen, and how many there are.
    std::vector<float> lens;
    int32_t lens_points = 0;
    std::vector<double> weights;
    // Two faces of different meshes that coincide, for each two such meshes. They share no line.
    std::vector<std::array<int32_t, 2>> coincident;

    int64_t size() const { return static_cast<int64_t>(faces.size() / 2); }
    void add(const Vector (&line)[2], IntersectedFace one, IntersectedFace other) {
        for (const Vector& e : line)
            for (double x : {e.x, e.y, e.z}) ends.push_back(static_cast<float>(x));
        for (const IntersectedFace& f : {one, other})
            faces.push_back(f.face), instances.push_back(f.instance);
    }
    // Appends the lines [first, last) of `from`.
    void add(const Intersections& from, int64_t first, int64_t last) {
        const auto append = [&](auto& to, const auto& all, int64_t each) {
            to.insert(to.end(), all.begin() + each * first, all.begin() + each * last);
        };
        append(ends, from.ends, 6), append(faces, from.faces, 2), append(instances, from.instances, 2);
    }
    void add(const Intersections& from, int64_t k) { add(from, k, k + 1); }
    void add(const std::vector<Intersections>& parts) {
        for (const Intersections& part : parts) {
            add(part, 0, part.size());
            coincident.insert(coincident.end(), part.coincident.begin(), part.coincident.end());
        }
    }
};

// Meshes with more faces are not searched for intersections with themselves. A larger limit finds more, but
// the search takes longer. Star-shaped meshes have none and are skipped at any size
// (boundary/meshes/star_shaped.h).
constexpr int32_t kSelfIntersectionFaces = 50'000;

// All intersections of meshes and instances that are visible to rays of `seers` (bits 1 << RayKind), where
// one of the two surfaces or the camera moves. Left out are (nearly) coplanar faces, because the velocity of
// their line is unbounded, and edges that lie in a face: that is contact, which the edge's own samples handle
// (derivations, F3).
Intersections find_intersections(const EdgeList& edges, const RequestedMotion& motion, int32_t seers);

// Selects those of `all` that move under `motion`. `all` may have been found for more motion.
Intersections moving_intersections(const SceneTables& tables, const RequestedMotion& motion,
                                   const Intersections& all);

// The edges of a scene with its intersections appended as further edges.
class EdgesAndIntersections {
 public:
    EdgesAndIntersections(const SceneTables& tables, Intersections intersections);

    // `scene` with edges and intersections. The result points into this object.
    SceneView view(SceneView scene) const;
    // The intersections alone, by their weights.
    Candidates intersections() const;
    // Appends the visible segments of the intersections to the candidates.
    void add_candidates(const CameraView& camera, Candidates& candidates) const;

 private:
    int32_t edge_count_;
    bool placed_;  // the scene has instances
    Intersections intersections_;
    std::vector<uint32_t> face_first_, faces_;
};

}  // namespace edgegrad
