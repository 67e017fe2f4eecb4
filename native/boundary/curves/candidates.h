// Candidate edges of the boundary terms: the edges across which radiance may be discontinuous, clipped to
// what the camera sees, with the weights by which they are sampled.
#pragma once

#include <cstdint>
#include <vector>

#include "boundary/curves/edge_cache.h"
#include "boundary/curves/edge_counts.h"
#include "scene/tables.h"
#include "scene/view.h"
#include "tasks/kernel_table.h"

namespace edgegrad {

// Segments of edges. u is the position along the edge, 0 at its first vertex.
struct Candidates {
    std::vector<int32_t> edge;
    std::vector<int32_t> instance;  // -1: the edge's mesh is not instanced; empty: no entry is instanced
    std::vector<float> u0, u1;
    std::vector<SegmentCell> cell;  // empty: all directions
    int32_t direction_cells = 1;
    // An entry stands for parts[i] equal segments, each with direction_cells^2 cells. These are computed on
    // the fly, because their number grows with the number of samples. Of `cell` then only `chained` counts.
    // Empty: each entry is one segment.
    std::vector<int32_t> parts;
    std::vector<double> cumulative{0.0};  // weight up to each entry, pixels
    EdgeCounts counts;                    // of a search
    // Filled by learned weights (boundary/curves/learned_weights.h), else empty; by segment. `unlearned` is
    // the weight before learning. `guess` holds estimates of the size of its samples, relative to their
    // weighted mean. The first averages over few neighbours, the second over many.
    std::vector<double> unlearned;
    std::vector<float> guess[2];

    // Appends a segment; its instance and cell are appended apart.
    void add(int32_t line, float from, float to, double mass) {
        edge.push_back(line), u0.push_back(from), u1.push_back(to);
        cumulative.push_back(cumulative.back() + mass);
    }

    int64_t size() const { return static_cast<int64_t>(edge.size()); }
    double mass() const { return cumulative.back(); }
    // Whether the last entries are for receivers that the camera sees through other surfaces.
    bool chained() const { return !cell.empty() && cell.back().chained(); }
    // The weight of each segment of an entry.
    double segment_mass(size_t i) const {
        const double mass = cumulative[i + 1] - cumulative[i];
        return parts.empty() ? mass
                             : mass / (static_cast<double>(parts[i]) * direction_cells * direction_cells);
    }
};

// Unit normals (F, 3) of all faces by winding order; zero for faces without area.
std::vector<float> unit_normals(const SceneTables& tables, int threads);

// All edges of a scene, ordered by mesh.
struct EdgeList {
    const SceneTables& tables;
    const int8_t* solid_side;            // by mesh (boundary/meshes/solids.h)
    const std::vector<uint8_t>& closed;  // by mesh (closed_meshes)
    const std::vector<uint8_t>& clear;   // by mesh: it emits light and occludes nothing of itself
    const float* normal;                 // by face (unit_normals)
    const KernelTable& kernels;
    int threads;
    const std::shared_ptr<const LightList>& lights;
    EdgeCache& kept;
    // Searches need not find all candidates: only the counts, and whether there is any.
    bool counts_alone = false;
    // Above 1: the edges of a mesh with several instances are cut into so many windows, and of each instance
    // only those in one random window are listed. Each edge is listed with the probability 1 / windows, so
    // that an estimate from these edges, times `windows`, has the mean of one from all. 100,000 instances of
    // a mesh of 1,500 edges would take gigabytes and seconds otherwise, for far fewer samples.
    int32_t windows = 1;
    uint32_t seed = 0;
    // Which edges a search lists: all, those that windows do not concern, or those in windows.
    enum Part { kAll, kWhole, kWindows } part = kAll;

    int64_t count() const { return static_cast<int64_t>(tables.edge_vertices.size() / 2); }
    // Else it is an intersection curve.
    bool is_edge(int32_t line) const { return line < count(); }
};

// The windows that leave about `most` edges of instances.
int32_t edge_windows(const SceneTables& tables, int64_t most);

// Candidates of the primary term: edges that the camera sees and that may move in the picture. These are the
// edges of moving meshes and instances, or all edges if the camera moves. Only a flat pair of faces is left
// out: two faces in one plane, with the same orientation and material, and no seam between them
// (boundary/meshes/seams.h). Silhouettes, open borders, creases, edges between the facets of a smooth mesh
// and material borders need no distinction (derivations, A3 and 0.5).
Candidates primary_candidates(const SceneView& scene, const EdgeList& edges, const RequestedMotion& motion);

// Candidates of the shadow term: edges that may occlude light. Towards lights these are the silhouettes seen
// from some point of a light. Towards the environment these are all edges except flat ones. Edges of static
// meshes are included, because the receiver or the light may move.
Candidates shadow_candidates(const SceneView& scene, const EdgeList& edges, bool environment);

// Edges of meshes whose faces scatter light of a fixed direction near contact over their borders, which are
// sampled (scene/contact.h), except flat ones.
Candidates border_candidates(const SceneView& scene, const EdgeList& edges);

// Edges of emissive faces whose light is parametrised by a fixed direction
// (shading/lights/fixed_direction_light.h), except flat ones.
Candidates emitter_candidates(const SceneView& scene, const EdgeList& edges);
// Whether a face of the edge emits such light.
bool any_fixed_direction(const SceneView& scene, int64_t edge);

}  // namespace edgegrad
