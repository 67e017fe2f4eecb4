#include "boundary/meshes/touching_meshes.h"

#include <algorithm>
#include <atomic>

#include "boundary/meshes/face_cut.h"
#include "boundary/meshes/trees/mesh_trees.h"
#include "scene/mesh_instances.h"

namespace edgegrad {
namespace {

// Signed distance of a point to a triangle's plane, times the length of the normal.
double height_above(const Triangle3& t, Vector p) { return dot(t.normal, p - t.p[0]); }

// Whether a segment in a triangle's plane overlaps the triangle, its border included, in more than a point.
bool overlaps(const Triangle3& t, Vector a, Vector b, double tolerance) {
    // Rounding may bring segments that meet at a point this many tolerances into each other
    constexpr double kPoint = 10.0;
    double first = 0.0, last = 1.0;
    for (size_t k = 0; k < 3; ++k) {
        const Vector inward = cross(t.normal, t.p[(k + 1) % 3] - t.p[k]);
        const double slack = tolerance * length(inward);
        const double from = dot(inward, a - t.p[k]) + slack, to = dot(inward, b - t.p[k]) + slack;
        if (from < 0.0 && to < 0.0) return false;
        if (from < 0.0) first = std::max(first, from / (from - to));
        if (to < 0.0) last = std::min(last, from / (from - to));
    }
    return (last - first) * length(b - a) > kPoint * tolerance;
}

// Calls accept(k, coplanar, most) for the edges of `s`, from its corner k to the next one, that lie on `t`,
// until it returns true. Heights above the plane of `t` up to `most` count as zero; `coplanar`: all of `s` is
// in the plane.
template <typename Accept>
bool any_edge_on(const Triangle3& s, const Triangle3& t, const Accept& accept) {
    const double tolerance = kOnPlane * std::max(s.size, t.size), most = tolerance * length(t.normal);
    if (!(most > 0.0)) return false;
    bool on[3];
    int count = 0;
    for (size_t k = 0; k < 3; ++k) {
        on[k] = std::abs(height_above(t, s.p[k])) <= most;
        count += on[k];
    }
    for (size_t k = 0; k < 3 && count >= 2; ++k) {
        const size_t next = (k + 1) % 3;
        if (on[k] && on[next] && overlaps(t, s.p[k], s.p[next], tolerance) && accept(k, count == 3, most))
            return true;
    }
    return false;
}

class ContactSearch {
 public:
    ContactSearch(const SceneTables& tables, const MovingMeshes& moving, const MeshBoxes& boxes,
                  const MeshTrees& trees, int threads)
        : tables_(tables), trees_(trees), threads_(threads) {
        // Bound what moves and what does not
        const auto instances = mesh_instances(tables);
        std::vector<Box> moved, still;
        std::vector<size_t> of_moved, of_still;
        for (size_t m = 0; m < instances.size(); ++m)
            for (const int32_t instance : instances[m]) {
                const Box& own = boxes.of[m];
                if (own.is_empty()) continue;
                const bool moves =
                    moving.meshes[m] || (instance >= 0 && moving.instances[static_cast<size_t>(instance)]);
                (moves ? of_moved : of_still).push_back(meshes_.size());
                meshes_.emplace_back(tables, static_cast<int32_t>(m), instance, own);
                (moves ? moved : still).push_back(padded(meshes_.back().box));
            }
        // Pair each that moves with those that do not
        const auto mask = [&](size_t k) { return tables.mesh_mask[static_cast<size_t>(meshes_[k].mesh)]; };
        const BoxPairs tree(moved);
        for (size_t k = 0; k < still.size(); ++k)
            tree.visit(still[k], [&](size_t j) {
                const size_t a = of_moved[j], b = of_still[k];
                if (mask(a) & mask(b)) pairs_.push_back({a, b});
            });
    }

    MeshPairs find() {
        // Many instances of two meshes may meet, of which the first contact serves
        std::vector<size_t> number;  // by pair, that of its name
        MeshPairs names;             // the meshes of all pairs, each once
        for (const BoxPair& pair : pairs_) names.push_back(name(pair));
        std::sort(names.begin(), names.end());
        names.erase(std::unique(names.begin(), names.end()), names.end());
        for (const BoxPair& pair : pairs_)
            number.push_back(static_cast<size_t>(std::lower_bound(names.begin(), names.end(), name(pair)) -
                                                 names.begin()));
        std::vector<std::atomic<bool>> touching(names.size());
        search_near(trees_, meshes_, pairs_, threads_,
                    [&](size_t k, const NearMeshes& near, FaceTree::Pair part) {
                        std::atomic<bool>& met = touching[number[k]];
                        if (met) return;
                        near.visit(part, [&](int32_t face, int32_t of_other) {
                            if (touch(near, face, of_other)) met = true;
                            return !met.load();
                        });
                    });
        MeshPairs out;
        for (size_t k = 0; k < names.size(); ++k)
            if (touching[k]) out.push_back(names[k]);
        return out;
    }

 private:
    std::array<int32_t, 2> name(const BoxPair& pair) const {
        const int32_t a = meshes_[pair[0]].mesh, b = meshes_[pair[1]].mesh;
        return {std::min(a, b), std::max(a, b)};
    }

    // Whether a face has an area.
    bool has_area(int32_t face) const {
        return tables_.face_collinear.empty() || !tables_.face_collinear[static_cast<size_t>(face)];
    }

    bool touch(const NearMeshes& near, int32_t face, int32_t of_other) {
        if (!has_area(face) || !has_area(of_other)) return false;
        const Triangle3 s(tables_, face, near.one->place), t(tables_, of_other, near.other->place);
        return lies_on(*near.one, s, t) || lies_on(*near.other, t, s);
    }

    // Whether an edge of the face `s` of a mesh lies on `t`, and the mesh does not pass through `t` there.
    bool lies_on(const PlacedMesh& mesh, const Triangle3& s, const Triangle3& t) {
        return any_edge_on(s, t, [&](size_t k, bool coplanar, double most) {
            return coplanar || !passes_through(mesh, s, k, t, most);
        });
    }

    // Whether faces of a mesh along the edge k of its face `s` are on both sides of the plane of `t`.
    bool passes_through(const PlacedMesh& mesh, const Triangle3& s, size_t k, const Triangle3& t,
                        double most) {
        const Vector &a = s.p[k], &b = s.p[(k + 1) % 3];
        const double own = height_above(t, s.p[(k + 2) % 3]), together = kOnPlane * s.size;
        bool both_sides = false;
        Box middle;
        add_point(middle, mesh.local((a + b) * 0.5));
        middle = padded(middle);
        trees_.within(mesh.mesh, middle, 1)->visit(middle, [&](int32_t f) {
            const Triangle3 next(tables_, f, mesh.place);
            for (size_t j = 0; j < 3; ++j) {
                const Vector &c = next.p[j], &d = next.p[(j + 1) % 3];
                const double apart =
                    std::min(std::max(length(c - a), length(d - b)), std::max(length(c - b), length(d - a)));
                const double its = height_above(t, next.p[(j + 2) % 3]);
                both_sides |= apart <= together && std::abs(its) > most && (its < 0.0) != (own < 0.0);
            }
        });
        return both_sides;
    }

    const SceneTables& tables_;
    const MeshTrees& trees_;
    const int threads_;
    std::vector<PlacedMesh> meshes_;
    std::vector<BoxPair> pairs_;
};

}  // namespace

MeshPairs touching_meshes(const SceneTables& tables, const MovingMeshes& moving, const MeshBoxes& boxes,
                          const MeshTrees& trees, int threads) {
    const auto none = [](const std::vector<uint8_t>& of) {
        return std::find(of.begin(), of.end(), uint8_t{1}) == of.end();
    };
    if (none(moving.meshes) && none(moving.instances)) return {};
    return ContactSearch(tables, moving, boxes, trees, threads).find();
}

}  // namespace edgegrad
