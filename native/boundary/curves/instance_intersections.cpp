#include "boundary/curves/instance_intersections.h"

#include <algorithm>
#include <numeric>

#include "boundary/meshes/box_pairs.h"
#include "boundary/meshes/face_cut.h"
#include "scene/mesh_instances.h"
#include "util/parallel.h"

namespace edgegrad {
namespace {

// The pairs of instances whose boxes overlap and for which requested(one, other) holds, sorted by their lower
// bounds along the axis of largest spread.
template <typename Requested>
std::vector<BoxPair> meeting_pairs(const std::vector<PlacedMesh>& meshes, const Requested& requested) {
    Box middles;
    for (const PlacedMesh& placed : meshes)
        add_point(middles, (vector_at(placed.box.low) + vector_at(placed.box.high)) * 0.5);
    int axis = 0;
    for (int c = 1; c < 3; ++c)
        if (middles.high[c] - middles.low[c] > middles.high[axis] - middles.low[axis]) axis = c;
    std::vector<size_t> order(meshes.size());
    std::iota(order.begin(), order.end(), size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](size_t a, size_t b) { return meshes[a].box.low[axis] < meshes[b].box.low[axis]; });
    std::vector<Box> boxes;
    for (size_t k : order) boxes.push_back(meshes[k].box);
    std::vector<BoxPair> out = BoxPairs(boxes).pairs(
        [&](size_t a, size_t b) { return requested(meshes[order[a]], meshes[order[b]]); });
    for (auto& [one, other] : out) one = order[one], other = order[other];
    return out;
}

// Finds the intersections of two instances. The boxes of one's faces are looked up in the tree of the other's
// mesh, in that mesh's space.
void search_mesh_pair(const SceneTables& tables, const std::vector<FaceTree>& trees, const PlacedMesh* one,
                      const PlacedMesh* other, Intersections& out) {
    const Box common = common_box(*one, *other);
    const auto faces_of = [&](const PlacedMesh& placed) {
        std::vector<int32_t> faces;
        trees[static_cast<size_t>(placed.mesh)].visit(placed.local(common),
                                                      [&](int32_t f) { faces.push_back(f); });
        return faces;
    };
    std::vector<int32_t> few = faces_of(*one);
    if (few.empty()) return;
    if (std::vector<int32_t> many = faces_of(*other); many.size() < few.size())
        std::swap(few, many), std::swap(one, other);
    for (int32_t face : few) {
        if (cancelled()) return;
        const Triangle3 t(tables, face, one->place);
        visit_near(trees[static_cast<size_t>(other->mesh)], *other, t.p, [&](int32_t f) {
            Vector ends[2];
            if (shared_line(t, Triangle3(tables, f, other->place), ends))
                out.add(ends, {static_cast<uint32_t>(face), one->instance},
                        {static_cast<uint32_t>(f), other->instance});
        });
    }
}

}  // namespace

void place_intersections(const SceneTables& tables, const Intersections& own,
                         std::span<const int32_t> instances, Intersections& out) {
    for (int32_t instance : instances) {
        may_cancel();
        const Placement place = Placement::of(tables, instance);
        for (size_t k = 0; k < own.faces.size(); k += 2) {
            Vector ends[2];
            const Triangle3 one(tables, static_cast<int32_t>(own.faces[k]), place);
            const Triangle3 other(tables, static_cast<int32_t>(own.faces[k + 1]), place);
            if (shared_line(one, other, ends))
                out.add(ends, {own.faces[k], instance}, {own.faces[k + 1], instance});
        }
    }
}

void search_instances(const SceneTables& tables, const RequestedMotion& motion, int32_t seers, int threads,
                      Intersections& out) {
    const auto instances = mesh_instances(tables);
    // List all meshes and instances that the rays see
    std::vector<PlacedMesh> meshes;
    for (size_t m = 0; m < instances.size(); ++m) {
        if (!(tables.mesh_mask[m] & seers)) continue;
        const Box box = mesh_box(tables, m);
        for (int32_t instance : instances[m])
            meshes.emplace_back(tables, static_cast<int32_t>(m), instance, box);
    }
    // Select the pairs that may move and whose boxes overlap
    const auto requested = [&](const PlacedMesh& one, const PlacedMesh& other) {
        if (one.instance < 0 && other.instance < 0)
            return false;  // boundary/curves/intersections.cpp covers these
        return motion.camera || motion.instances || motion.moving[static_cast<size_t>(one.mesh)] ||
               motion.moving[static_cast<size_t>(other.mesh)];
    };
    const std::vector<BoxPair> pairs = meeting_pairs(meshes, requested);
    // Build a tree of faces for each mesh of these pairs
    std::vector<uint8_t> met(instances.size(), 0);
    for (const BoxPair& pair : pairs)
        for (size_t k : pair) met[static_cast<size_t>(meshes[k].mesh)] = 1;
    std::vector<FaceTree> trees;
    for (size_t m = 0; m < instances.size(); ++m) {
        std::vector<int32_t> faces;
        if (met[m])
            faces.resize(static_cast<size_t>(tables.mesh_first_face[m + 1] - tables.mesh_first_face[m]));
        std::iota(faces.begin(), faces.end(), tables.mesh_first_face[m]);
        trees.emplace_back(tables, std::move(faces), threads);
    }
    // Intersect the pairs in parallel
    constexpr size_t kBlock = 16;
    std::vector<Intersections> parts((pairs.size() + kBlock - 1) / kBlock);
    parallel_for(threads, static_cast<int64_t>(parts.size()), nullptr, [&](int, int64_t part) {
        const size_t first = static_cast<size_t>(part) * kBlock;
        for (size_t k = first; k < std::min(pairs.size(), first + kBlock); ++k)
            search_mesh_pair(tables, trees, &meshes[pairs[k][0]], &meshes[pairs[k][1]],
                             parts[static_cast<size_t>(part)]);
    });
    out.add(parts);
}

}  // namespace edgegrad
