// Candidate edges of the boundary terms: which edges can carry a jump, clipped to what the camera sees, with
// the mass by which they are sampled.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "boundary/curves/edge_cache.h"
#include "boundary/curves/edge_counts.h"
#include "scene/tables.h"
#include "scene/view.h"
#include "tasks/kernel_table.h"

namespace edgegrad {

// Pieces of edges; u is the position along the edge, 0 at its first vertex.
struct Candidates {
    std::vector<int32_t> edge;
    std::vector<int32_t> instance;  // -1: the edge stands in the world; empty: all do
    std::vector<float> u0, u1;
    std::vector<int32_t> cell;  // of directions (tasks/kernel_table.h, BoundaryTask); empty: all directions
    int32_t direction_cells = 1;
    // So many equal parts of each entry, each with all direction_cells^2 cells, are its pieces. They are not
    // listed: their number grows with that of the samples. Of `cell` then only kChained counts. Empty: an
    // entry is one piece.
    std::vector<int32_t> parts;
    std::vector<double> cumulative{0.0};  // mass up to each entry, pixels
    EdgeCounts counts;                    // of a search
    // Of what was learned (boundary/curves/learned_weights.h; empty: nothing was), by piece: the mass that it
    // has but for that, and guesses of how large samples on it are, of mean 1 over the mass: from few and
    // from many neighbours.
    std::vector<double> unlearned;
    std::vector<float> guess[2];

    int64_t size() const { return static_cast<int64_t>(edge.size()); }
    double mass() const { return cumulative.back(); }
    // The mass of each of an entry's pieces.
    double segment_mass(size_t i) const {
        const double mass = cumulative[i + 1] - cumulative[i];
        return parts.empty() ? mass
                             : mass / (static_cast<double>(parts[i]) * direction_cells * direction_cells);
    }
};

// Unit normals (F, 3) of all faces as they are wound; zero where a face has no area.
std::vector<float> unit_normals(const SceneTables& tables, int threads);

// All edges of a scene, in the order of meshes.
struct EdgeList {
    const SceneTables& tables;
    const int8_t* solid_side;            // by mesh (boundary/meshes/solids.h)
    const std::vector<uint8_t>& closed;  // by mesh (closed_meshes)
    const std::vector<uint8_t>& clear;   // by mesh: it gives light and hides nothing of itself
    const float* normal;                 // by face (unit_normals)
    const KernelTable& kernels;
    int threads;
    const std::shared_ptr<const LightList>& lights;
    EdgeCache& kept;

    int64_t count() const { return static_cast<int64_t>(tables.edge_vertices.size() / 2); }
};

// Edges that the camera sees and that may move in the picture: those of moving meshes and
// instances, or all if the camera moves.
// Only a flat pair of faces can't carry a jump: two faces in one plane, of one orientation, one material and
// no seam between them (boundary/meshes/seams.h). Silhouettes, open borders, creases, the edges between the
// facets of a smooth mesh and material borders are one case (derivations A3, 0.5a).
Candidates primary_candidates(const SceneView& scene, const EdgeList& edges, const RequestedMotion& motion);

// Edges that may hide light from a surface: silhouettes as seen from some point of the lights, or (towards
// the environment) all that are not flat. Of all meshes: what moves may also
// be the surface or the light.
Candidates shadow_candidates(const SceneView& scene, const EdgeList& edges, bool environment);

// Edges of emissive faces whose light holds its direction (shading/lights/fixed_direction_light.h), but for
// flat ones.
Candidates emitter_candidates(const SceneView& scene, const EdgeList& edges);
// Whether a face of the edge is such.
bool any_held(const SceneView& scene, int64_t edge);

// Pieces of candidates by cells of directions: `direction_cells`^2 of each part between neighbouring borders,
// which borders(k, u) gives of candidate k. `chains`: also of segments that the camera sees by way of other
// surfaces.
using Borders = std::function<void(size_t k, std::vector<float>& u)>;
Candidates cut(const Candidates& edges, int32_t direction_cells, bool chains, const Borders& borders);

// Cells of the picture, about `wanted`, for samples that start at the camera: they have the place of cells of
// directions of one edge, which says nothing else. `chains`: also of paths that go on from the first surface
// that they meet before they pass an edge.
Candidates whole_picture();
Candidates over_picture(double requested, bool chains);

// The same edges for light between surfaces: their parts and the cells of their directions make about
// `wanted` pieces. `chains`: also of segments that the camera sees by way of other surfaces.
Candidates over_directions(const Candidates& edges, double requested, bool chains);

}  // namespace edgegrad
