#include "boundary/meshes/touching_meshes.h"

#include <algorithm>
#include <atomic>
#include <memory>
#include <mutex>
#include <numeric>

#include "boundary/meshes/box_pairs.h"
#include "boundary/meshes/face_cut.h"
#include "boundary/meshes/placement.h"
#include "scene/mesh_instances.h"
#include "util/parallel.h"

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
    ContactSearch(const SceneTables& tables, const MovingMeshes& moving, const MeshBoxes& boxes, int threads)
        : tables_(tables),
          threads_(threads),
          pairs_of_(boxes.of.size()),
          scans_(boxes.of.size()),
          trees_(boxes.of.size()) {
        // Bound what moves and what does not
        const auto instances = mesh_instances(tables);
        std::vector<Box> moved, still;
        std::vector<size_t> of_moved, of_still;
        for (size_t m = 0; m < instances.size(); ++m)
            for (const int32_t instance : instances[m]) {
                const Box& own = boxes.of[m];
                if (own.low[0] > own.high[0]) continue;
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
        for (const BoxPair& pair : pairs_)
            for (const size_t k : pair) ++pairs_of_[static_cast<size_t>(meshes_[k].mesh)];
    }

    MeshPairs find() {
        // Many instances of two meshes may meet, of which the first contact serves
        for (const BoxPair& pair : pairs_) names_.push_back(name(pair));
        std::sort(names_.begin(), names_.end());
        names_.erase(std::unique(names_.begin(), names_.end()), names_.end());
        touching_ = std::vector<std::atomic<bool>>(names_.size());
        for (const BoxPair& pair : pairs_) add(pair);
        // Search blocks of faces in parallel
        std::vector<std::pair<const Near*, size_t>> blocks;
        for (const Near& found : near_)
            for (size_t k = 0; k < found.faces.size(); k += kBlock) blocks.emplace_back(&found, k);
        parallel_for(threads_, static_cast<int64_t>(blocks.size()), nullptr, [&](int, int64_t k) {
            const auto [found, first] = blocks[static_cast<size_t>(k)];
            search(*found, first, std::min(first + kBlock, found->faces.size()));
        });
        MeshPairs out;
        for (size_t k = 0; k < names_.size(); ++k)
            if (touching_[k]) out.push_back(names_[k]);
        return out;
    }

 private:
    static constexpr size_t kBlock = 512;
    // Each face of a mesh is compared with this many faces of another one. Above, a tree is faster.
    static constexpr size_t kFew = 8;
    // Meshes in more pairs, and of more faces, get a tree of all faces. For others, faces near another mesh
    // are found by a loop over all.
    static constexpr size_t kFewPairs = 8, kSmallMesh = 64;
    // So often the faces around an edge are found by a loop before a mesh gets a tree. The first edge that is
    // looked at mostly touches.
    static constexpr int kFewScans = 4;

    // The faces of one mesh of a pair that are near the other one, and those of the other one: few, or in a
    // tree.
    struct Near {
        const PlacedMesh *one, *other;
        size_t name;
        std::vector<int32_t> faces;
        std::vector<Triangle3> few;
        std::unique_ptr<FaceTree> own_tree;
        const FaceTree* tree = nullptr;
    };

    std::array<int32_t, 2> name(const BoxPair& pair) const {
        const int32_t a = meshes_[pair[0]].mesh, b = meshes_[pair[1]].mesh;
        return {std::min(a, b), std::max(a, b)};
    }

    // Whether a face has an area.
    bool has_area(int32_t face) const {
        return tables_.face_collinear.empty() || !tables_.face_collinear[static_cast<size_t>(face)];
    }

    // The tree of all faces of a mesh.
    const FaceTree& whole_tree(int32_t mesh) {
        const auto m = static_cast<size_t>(mesh);
        const std::lock_guard<std::mutex> lock(planting_);
        if (!trees_[m]) {
            const int32_t first = tables_.mesh_first_face[m];
            std::vector<int32_t> faces(static_cast<size_t>(tables_.mesh_first_face[m + 1] - first));
            std::iota(faces.begin(), faces.end(), first);
            trees_[m] = std::make_unique<FaceTree>(tables_, std::move(faces), 1);
        }
        return *trees_[m];
    }
    bool has_whole_tree(int32_t mesh) const {
        const auto m = static_cast<size_t>(mesh);
        return pairs_of_[m] > kFewPairs &&
               static_cast<size_t>(tables_.mesh_first_face[m + 1] - tables_.mesh_first_face[m]) > kSmallMesh;
    }

    std::vector<int32_t> faces_near(const PlacedMesh& placed, const Box& common) {
        const Box box = placed.local(common);
        std::vector<int32_t> faces;
        if (has_whole_tree(placed.mesh))
            whole_tree(placed.mesh).visit(box, [&](int32_t f) { faces.push_back(f); });
        else
            faces = std::move(faces_in(tables_, placed.mesh, {&box, 1}, threads_).front());
        std::erase_if(faces, [&](int32_t f) { return !has_area(f); });
        return faces;
    }

    void add(const BoxPair& pair) {
        may_cancel();
        const PlacedMesh *one = &meshes_[pair[0]], *other = &meshes_[pair[1]];
        const Box common = common_box(*one, *other);
        std::vector<int32_t> faces = faces_near(*one, common);
        if (faces.empty()) return;
        std::vector<int32_t> others = faces_near(*other, common);
        if (others.empty()) return;
        const auto at = std::lower_bound(names_.begin(), names_.end(), name(pair));
        Near found{one, other, static_cast<size_t>(at - names_.begin()), {}, {}, nullptr, nullptr};
        if (faces.size() < others.size()) std::swap(faces, others), std::swap(found.one, found.other);
        if (others.size() <= kFew) {
            for (const int32_t f : others) found.few.emplace_back(tables_, f, found.other->place);
            found.faces = std::move(faces);
        } else {
            // The tree is of the mesh with more faces
            std::swap(found.one, found.other);
            if (has_whole_tree(found.other->mesh)) {
                found.tree = &whole_tree(found.other->mesh);
            } else {
                found.own_tree = std::make_unique<FaceTree>(tables_, std::move(faces), threads_);
                found.tree = found.own_tree.get();
            }
            found.faces = std::move(others);
        }
        near_.push_back(std::move(found));
    }

    void search(const Near& found, size_t first, size_t last) {
        std::atomic<bool>& touching = touching_[found.name];
        const auto compare = [&](const Triangle3& s, const Triangle3& t) {
            if (touch(*found.one, s, *found.other, t)) touching = true;
        };
        for (size_t k = first; k < last && !touching && !cancelled(); ++k) {
            const Triangle3 s(tables_, found.faces[k], found.one->place);
            for (const Triangle3& t : found.few) compare(s, t);
            if (!found.tree) continue;
            visit_near(*found.tree, *found.other, s.p, [&](int32_t f) {
                if (has_area(f)) compare(s, Triangle3(tables_, f, found.other->place));
            });
        }
    }

    bool touch(const PlacedMesh& one, const Triangle3& s, const PlacedMesh& other, const Triangle3& t) {
        return lies_on(one, s, t) || lies_on(other, t, s);
    }

    // Whether an edge of the face `s` of a mesh lies on `t`, and the mesh does not pass through `t` there.
    bool lies_on(const PlacedMesh& mesh, const Triangle3& s, const Triangle3& t) {
        return any_edge_on(s, t, [&](size_t k, bool coplanar, double most) {
            return coplanar || !passes_through(mesh, s, k, t, most);
        });
    }

    // Calls visit_face(face) for the faces of a mesh whose boxes contain a point in the world.
    template <typename Visit>
    void visit_around(const PlacedMesh& mesh, Vector point, const Visit& visit_face) {
        const auto m = static_cast<size_t>(mesh.mesh);
        if (has_whole_tree(mesh.mesh) || scans_[m].fetch_add(1, std::memory_order_relaxed) >= kFewScans) {
            visit_near(whole_tree(mesh.mesh), mesh, std::array<Vector, 1>{point}, visit_face);
            return;
        }
        Box box;
        add_point(box, mesh.local(point));
        box = padded(box);
        for (int32_t f = tables_.mesh_first_face[m]; f < tables_.mesh_first_face[m + 1]; ++f)
            if (box_of(tables_, f).meets(box)) visit_face(f);
    }

    // Whether faces of a mesh along the edge k of its face `s` are on both sides of the plane of `t`.
    bool passes_through(const PlacedMesh& mesh, const Triangle3& s, size_t k, const Triangle3& t,
                        double most) {
        const Vector &a = s.p[k], &b = s.p[(k + 1) % 3];
        const double own = height_above(t, s.p[(k + 2) % 3]), together = kOnPlane * s.size;
        bool both_sides = false;
        visit_around(mesh, (a + b) * 0.5, [&](int32_t f) {
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
    const int threads_;
    std::vector<PlacedMesh> meshes_;
    std::vector<BoxPair> pairs_;
    std::vector<size_t> pairs_of_;  // by mesh: how many pairs it is in
    MeshPairs names_;               // the meshes of all pairs, each once
    std::vector<std::atomic<bool>> touching_;
    std::vector<Near> near_;
    std::vector<std::atomic<int>> scans_;  // by mesh: edges whose faces a loop has found
    std::mutex planting_;
    std::vector<std::unique_ptr<FaceTree>> trees_;  // by mesh
};

}  // namespace

MeshPairs touching_meshes(const SceneTables& tables, const MovingMeshes& moving, const MeshBoxes& boxes,
                          int threads) {
    const auto none = [](const std::vector<uint8_t>& of) {
        return std::find(of.begin(), of.end(), uint8_t{1}) == of.end();
    };
    if (none(moving.meshes) && none(moving.instances)) return {};
    return ContactSearch(tables, moving, boxes, threads).find();
}

}  // namespace edgegrad
