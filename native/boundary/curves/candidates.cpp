#include "boundary/curves/candidates.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "boundary/curves/picture_frame.h"
#include "boundary/meshes/seams.h"
#include "boundary/meshes/trees/placement.h"
#include "sampling/z_order.h"
#include "scene/lights/light_list.h"
#include "scene/mesh_edges.h"
#include "scene/mesh_instances.h"
#include "tasks/block_sizes.h"
#include "tasks/seed_tags.h"
#include "util/parallel.h"

namespace edgegrad {
namespace {

using V = Vector;

// Edges per item of parallel work.
constexpr int64_t kEdgeBlock = 1 << 13;
// The memory of searches that find more candidates is not kept for later ones.
constexpr size_t kMostSpare = size_t{1} << 22;

// The order of candidates: silhouettes, borders and sharp creases come before blunt creases, and each group
// follows a Z-order curve of picture tiles. Neighbours on the list are thus of one kind and close in the
// picture. This stratifies systematic samples, and lets a guide predict each candidate from its neighbours.
constexpr uint32_t kTiles = 1u << (2 * kTileBits), kPlaces = 2 * kTiles;
constexpr float kBlunt = 0.5f;

uint32_t place_of(uint32_t tile, float weight) { return tile + (weight < kBlunt ? kTiles : 0u); }

// A range of edges of one mesh, placed by one instance.
struct Run {
    int32_t mesh, instance;
    int64_t first, count;
    bool counts;  // the first instance's edges stand for those of all
    bool lists;   // its edges become candidates
};

// A hash (the finaliser of splitmix64, Steele et al. 2014).
uint32_t random_bits(uint32_t seed, uint32_t k) {
    uint64_t x = ((uint64_t{seed} << 32) | k) + 0x9e3779b97f4a7c15ull;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
    return static_cast<uint32_t>((x ^ (x >> 31)) >> 32);
}

// The range of an instance's edges that is its window.
std::pair<int64_t, int64_t> window_of(const EdgeList& edges, int32_t instance, int64_t first, int64_t last) {
    const int64_t random = random_bits(edges.seed ^ kWindowSeed, static_cast<uint32_t>(instance));
    const int64_t window = (random * edges.windows) >> 32, count = last - first;
    return {first + count * window / edges.windows, first + count * (window + 1) / edges.windows};
}

// The ranges of edges of all meshes for which requested(mesh, is placed) holds, with all instances.
template <typename Requested>
std::vector<Run> runs_of(const EdgeList& edges, const Requested& requested) {
    const SceneTables& t = edges.tables;
    const auto instances = mesh_instances(t);
    std::vector<Run> runs;
    for (int32_t mesh = 0; mesh < t.visible_meshes; ++mesh) {
        const MeshInstances::Copies of_mesh = instances[static_cast<size_t>(mesh)];
        if (!requested(mesh, is_placed(of_mesh))) continue;
        const bool cut = of_mesh.size() > 1;
        if (edges.part != EdgeList::kAll && cut != (edges.part == EdgeList::kWindows)) continue;
        const auto [first, last] = mesh_edges(t, static_cast<size_t>(mesh));
        const auto add = [&](int32_t instance, int64_t from, int64_t to, bool counts, bool lists) {
            for (int64_t k = from; k < to; k += kEdgeBlock)
                runs.push_back({mesh, instance, k, std::min(kEdgeBlock, to - k), counts, lists});
        };
        if (edges.part == EdgeList::kWindows) add(of_mesh.front(), first, last, true, false);
        for (int32_t instance : of_mesh)
            if (edges.part != EdgeList::kWindows) {
                add(instance, first, last, instance == of_mesh.front(), true);
            } else {
                const auto [from, to] = window_of(edges, instance, first, last);
                add(instance, from, to, false, true);
            }
    }
    return runs;
}

// The output of the edge weight kernel for a run, in memory that a thread reuses.
struct RunWeights {
    std::vector<float> mass, pixels;
    std::vector<int32_t> tile, flat;
    std::vector<uint8_t> seam;

    EdgeWeightTask task(const EdgeList& edges, const Run& run, EdgeWeightKind kind) {
        for (auto* column : {&mass, &pixels}) column->resize(kEdgeBlock + kMaxWidth);
        for (auto* column : {&tile, &flat}) column->resize(kEdgeBlock + kMaxWidth);
        EdgeWeightTask t{};
        t.kind = kind;
        t.instance = run.instance;
        t.first = run.first, t.count = run.count;
        t.normal = edges.normal;
        t.clear_mesh = edges.clear[static_cast<size_t>(run.mesh)] ? run.mesh : -2;
        t.light_mesh = edges.lights->top_mesh().data();
        t.solid_side = edges.solid_side[run.mesh];
        t.mass = mass.data(), t.pixels = pixels.data();
        t.tile = tile.data(), t.flat = flat.data();
        return t;
    }
};

}  // namespace

// The candidates found in each run.
struct CandidateParts {
    struct Entry {
        int32_t edge;
        float u0, u1, mass;
    };
    // Places are stored separately, because the first pass of the counting sort reads only them.
    struct Run {
        std::vector<Entry> entries;
        std::vector<uint16_t> places;
        EdgeCounts counts;
    };
    std::vector<Run> runs;
};

namespace {

// Joins the candidates of all runs, sorted by place and then by run. This is a counting sort. Each thread
// handles one range of the runs.
void join(const CandidateParts& parts, const std::vector<Run>& runs, bool placed, int threads,
          Candidates& out) {
    const size_t ranges = std::clamp<size_t>(runs.size(), 1, static_cast<size_t>(threads));
    std::vector<std::vector<size_t>> at(
        ranges);  // by range and place: first the count, then the next position on the list
    const auto each_range = [&](const auto& visit) {
        parallel_for(threads, static_cast<int64_t>(ranges), nullptr, [&](int, int64_t k) {
            const auto range = static_cast<size_t>(k);
            const size_t last = runs.size() * (range + 1) / ranges;
            at[range].resize(kPlaces);
            for (size_t run = runs.size() * range / ranges; run < last; ++run)
                visit(run, parts.runs[run], at[range]);
        });
    };
    // Count the candidates of each range and place
    each_range([](size_t, const CandidateParts::Run& part, std::vector<size_t>& count) {
        for (uint16_t place : part.places) ++count[place];
    });
    // Turn the counts into positions on the list
    size_t all = 0;
    for (size_t place = 0; place < kPlaces; ++place)
        for (std::vector<size_t>& next : at) all += std::exchange(next[place], all);
    // Write the candidates to their positions
    out.edge.resize(all), out.u0.resize(all), out.u1.resize(all), out.cumulative.resize(all + 1);
    out.instance.resize(placed ? all : 0);
    each_range([&](size_t run, const CandidateParts::Run& part, std::vector<size_t>& next) {
        for (size_t k = 0; k < part.entries.size(); ++k) {
            const CandidateParts::Entry& entry = part.entries[k];
            const size_t to = next[part.places[k]]++;
            out.edge[to] = entry.edge;
            if (placed) out.instance[to] = runs[run].instance;
            out.u0[to] = entry.u0, out.u1[to] = entry.u1;
            out.cumulative[to + 1] = static_cast<double>(entry.mass);
        }
    });
    for (size_t k = 0; k < all; ++k) out.cumulative[k + 1] += out.cumulative[k];
}

// Collects candidates: visit(run, memory, counts, add) calls add for each candidate of a run, in parallel.
// The memory comes from pools of the edge cache.
template <typename Visit>
Candidates collect_all(const EdgeList& edges, const std::vector<Run>& runs, const Visit& visit) {
    std::shared_ptr<CandidateParts> parts = edges.kept.spare_parts.take();
    parts->runs.resize(runs.size());
    std::vector<RunWeights> memory(static_cast<size_t>(edges.threads));
    parallel_for(edges.threads, static_cast<int64_t>(runs.size()), nullptr, [&](int thread, int64_t k) {
        const Run& run = runs[static_cast<size_t>(k)];
        CandidateParts::Run& part = parts->runs[static_cast<size_t>(k)];
        part.entries.clear(), part.places.clear();
        part.counts = {};
        const auto most = static_cast<size_t>(run.count);
        part.entries.reserve(most), part.places.reserve(most);
        visit(run, memory[static_cast<size_t>(thread)], part.counts,
              [&](int64_t edge, float u0, float u1, float mass, uint32_t place) {
                  if (!(mass > 0.0f) || !run.lists) return;
                  part.entries.push_back({static_cast<int32_t>(edge), u0, u1, mass});
                  part.places.push_back(static_cast<uint16_t>(place));
              });
    });
    Candidates out;
    const std::shared_ptr<Candidates> old = edges.kept.spare_candidates.take();
    out.edge.swap(old->edge), out.instance.swap(old->instance);
    out.u0.swap(old->u0), out.u1.swap(old->u1), out.cumulative.swap(old->cumulative);
    join(*parts, runs, !edges.tables.instance_mesh.empty(), edges.threads, out);
    out.counts.of = edges.count();
    for (size_t k = 0; k < runs.size(); ++k)
        if (runs[k].counts) out.counts.add(parts->runs[k].counts);
    if (out.edge.size() <= kMostSpare) edges.kept.spare_parts.give(std::move(parts));
    return out;
}

// The same, or only those of each mesh's first instance, if counts are all that is needed and these show that
// there are candidates. Of a hundred thousand instances the other candidates take gigabytes.
template <typename Visit>
Candidates collect(const EdgeList& edges, const std::vector<Run>& runs, const Visit& visit) {
    if (edges.counts_alone) {
        std::vector<Run> first;
        std::copy_if(runs.begin(), runs.end(), std::back_inserter(first),
                     [](const Run& r) { return r.counts; });
        Candidates found = collect_all(edges, first, visit);
        if (found.size() > 0 || first.size() == runs.size()) return found;
    }
    return collect_all(edges, runs, visit);
}

// Whether the k-th edge of a run may carry a jump, by its shape.
bool keeps(const SceneTables& tables, const EdgeWeightTask& task, const Run& run, int64_t k,
           EdgeCounts& counts) {
    const bool flat = task.flat[k], kept = !flat || is_seam(tables, run.first + k);
    counts.kept += kept, counts.flat += !kept, counts.seams += flat && kept;
    return kept;
}

}  // namespace

int32_t edge_windows(const SceneTables& tables, int64_t most) {
    if (tables.instance_mesh.empty()) return 1;
    const auto instances = mesh_instances(tables);
    int64_t all = 1;
    for (size_t m = 0; m < instances.size(); ++m) {
        const auto [first, last] = mesh_edges(tables, m);
        if (instances[m].size() > 1) all += (last - first) * static_cast<int64_t>(instances[m].size());
    }
    return static_cast<int32_t>(std::min<int64_t>((all - 1) / std::max<int64_t>(most, 1) + 1, 1 << 16));
}

std::vector<float> unit_normals(const SceneTables& t, int threads) {
    const auto faces = static_cast<int64_t>(t.faces.size() / 3);
    std::vector<float> normals(static_cast<size_t>(3 * faces));
    parallel_for(threads, (faces + kEdgeBlock - 1) / kEdgeBlock, nullptr, [&](int, int64_t block) {
        for (int64_t f = block * kEdgeBlock; f < std::min(faces, (block + 1) * kEdgeBlock); ++f) {
            const auto corner = [&](int64_t k) -> Vector {
                const float* p =
                    &t.vertices[3 * static_cast<size_t>(t.faces[static_cast<size_t>(3 * f + k)])];
                return {p[0], p[1], p[2]};
            };
            const Vector a = corner(0), m = cross(corner(1) - a, corner(2) - a);
            const double size = length(m), inverse = size > 0.0 ? 1.0 / size : 0.0;
            float* n = &normals[static_cast<size_t>(3 * f)];
            n[0] = static_cast<float>(m.x * inverse);
            n[1] = static_cast<float>(m.y * inverse);
            n[2] = static_cast<float>(m.z * inverse);
        }
    });
    return normals;
}

Candidates primary_candidates(const SceneView& scene, const EdgeList& edges, const RequestedMotion& motion) {
    const CameraView& camera = scene.camera;
    const PictureFrame frame(camera);
    const SceneTables& tables = edges.tables;
    // Select the meshes that may move in the picture and that the camera sees
    const std::vector<Run> runs = runs_of(edges, [&](int32_t mesh, bool placed) {
        const auto m = static_cast<size_t>(mesh);
        return (motion.camera || motion.moving[m] || (motion.instances && placed)) &&
               (tables.mesh_mask[m] & (1 << kCameraRay));
    });
    return collect(edges, runs, [&](const Run& run, RunWeights& memory, EdgeCounts& counts, const auto& add) {
        // Compute the weights of the run's edges
        EdgeWeightTask task = memory.task(edges, run, kPictureWeight);
        task.sharp = scene.lights.kinds & kPointlikeLights;
        task.cut_all = frame.bends_or_blurs();
        task.lens_reach = static_cast<float>(frame.lens_reach());
        task.margin = static_cast<float>(frame.margin());
        edges.kernels.edge_weights(scene, task);
        const Placement place = Placement::of(scene, run.instance);
        // Add the edges, clipping those that the kernel did not place in the frame
        for (int64_t k = 0; k < run.count; ++k) {
            const float weight = task.mass[k];
            const int64_t edge = run.first + k;
            if (weight == 0.0f || !keeps(tables, task, run, k, counts)) continue;
            if (task.pixels[k] >= 0.0f) {
                add(edge, 0.0f, 1.0f, task.pixels[k] * weight,
                    place_of(static_cast<uint32_t>(task.tile[k]), weight));
                continue;
            }
            const EdgeEnds ends = EdgeEnds::of(scene, place, edge);
            frame.visit_segments(ends.a, ends.b, [&](const PictureFrame::EdgeSegment& segment) {
                const uint32_t tile = z_order(segment.x / camera.width, segment.y / camera.height, kTileBits);
                add(edge, static_cast<float>(segment.u0), static_cast<float>(segment.u1),
                    static_cast<float>(segment.pixels * static_cast<double>(weight)), place_of(tile, weight));
            });
        }
    });
}

namespace {

// Edges of the runs by their weights of a kind. `seams`: flat edges between different surfaces count.
Candidates weighed_candidates(const SceneView& scene, const EdgeList& edges, const std::vector<Run>& runs,
                              EdgeWeightKind kind, bool seams) {
    return collect(edges, runs, [&](const Run& run, RunWeights& memory, EdgeCounts& counts, const auto& add) {
        EdgeWeightTask task = memory.task(edges, run, kind);
        if (seams) {
            memory.seam.resize(kEdgeBlock);
            for (int64_t k = 0; k < run.count; ++k)
                memory.seam[static_cast<size_t>(k)] = is_seam(edges.tables, run.first + k);
            task.seam = memory.seam.data();
        }
        edges.kernels.edge_weights(scene, task);
        for (int64_t k = 0; k < run.count; ++k)
            if (keeps(edges.tables, task, run, k, counts)) add(run.first + k, 0.0f, 1.0f, task.mass[k], 0u);
    });
}

}  // namespace

Candidates shadow_candidates(const SceneView& scene, const EdgeList& edges, bool environment) {
    // Meshes that the camera alone sees hide no light
    const auto is_met = [&](int32_t mesh, bool) {
        return (edges.tables.mesh_mask[static_cast<size_t>(mesh)] & (kScatteredRays | 1 << kShadowRay)) != 0;
    };
    return weighed_candidates(scene, edges, runs_of(edges, is_met),
                              environment ? kEnvironmentWeight : kLightWeight,
                              scene.all_flags & kHasTransparency);
}

Candidates border_candidates(const SceneView& scene, const EdgeList& edges) {
    const auto is_open = [&](int32_t mesh, bool) { return (scene.mesh_contact[mesh] & kContactOpen) != 0; };
    return weighed_candidates(scene, edges, runs_of(edges, is_open), kBorderWeight, true);
}

bool any_fixed_direction(const SceneView& scene, int64_t edge) {
    const uint32_t first = scene.edge_face_first[edge], last = scene.edge_face_first[edge + 1];
    return scene.face_fixed_direction &&
           std::any_of(scene.edge_faces + first, scene.edge_faces + last,
                       [&](uint32_t face) { return scene.face_fixed_direction[face] != 0; });
}

Candidates emitter_candidates(const SceneView& scene, const EdgeList& edges) {
    // Select the meshes with faces of fixed-direction light
    const SceneTables& tables = edges.tables;
    const std::vector<Run> runs = runs_of(edges, [&](int32_t mesh, bool placed) {
        const auto m = static_cast<size_t>(mesh);
        const int32_t* fixed = scene.face_fixed_direction;
        return !placed &&
               std::any_of(fixed + tables.mesh_first_face[m], fixed + tables.mesh_first_face[m + 1],
                           [](int32_t f) { return f != 0; });
    });
    return collect(edges, runs, [&](const Run& run, RunWeights& memory, EdgeCounts&, const auto& add) {
        // Compute the weights of the run's edges
        EdgeWeightTask task = memory.task(edges, run, kEnvironmentWeight);
        edges.kernels.edge_weights(scene, task);
        for (int64_t k = 0; k < run.count; ++k) {
            const int64_t edge = run.first + k;
            if (task.flat[k] || !any_fixed_direction(scene, edge)) continue;
            // An edge between two materials bounds an emitter from all viewpoints.
            float mass = task.mass[k];
            const uint32_t first = scene.edge_face_first[edge];
            if (scene.edge_face_first[edge + 1] - first == 2 &&
                scene.face_material[scene.edge_faces[first]] !=
                    scene.face_material[scene.edge_faces[first + 1]])
                mass =
                    static_cast<float>(3.14159265 * length(vertex(scene, scene.edge_vertices[2 * edge + 1]) -
                                                           vertex(scene, scene.edge_vertices[2 * edge])));
            add(edge, 0.0f, 1.0f, mass, 0u);
        }
    });
}

}  // namespace edgegrad
