// Samples of one boundary kind, as input of its kernels.
#pragma once

#include <cstdint>

#include "tasks/boundary_kind.h"
#include "tasks/dropped_samples.h"
#include "tasks/edge_tree_view.h"
#include "tasks/image_task.h"

namespace edgegrad {

// The cell of a segment beside its part of an edge. Depending on the kind, it is a cell of directions about
// the edge, a cell of the picture, or a light instead of the edge. The cell also says whether the camera sees
// the samples by further surfaces.
class SegmentCell {
 public:
    SegmentCell() = default;
    constexpr SegmentCell(int32_t place, bool chained) : bits_(place | (chained ? kChained : 0)) {}
    constexpr bool chained() const { return bits_ & kChained; }
    // Index in the direction_cells^2 cells, row by row; for curves about lights the row of the light.
    constexpr int32_t place() const { return bits_ & ~kChained; }

 private:
    static constexpr int32_t kChained = 1 << 30;
    int32_t bits_;
};

// Samples of a term that later calls learn from (boundary/curves/learned_weights.h): the contribution of
// each, the expected number of samples on its segment, the segment (entry of the list, and cell), and the
// place on the edge.
struct SampleRecord {
    int32_t shift;                      // one of 2^shift samples is recorded
    float *contribution, *density, *u;  // null: nothing is learned
    int32_t* entry;                     // of the list of segments
    SegmentCell* cell;

    // Whether sample `number` is recorded, and where.
    bool has(int64_t number) const { return contribution && (number & ((int64_t{1} << shift) - 1)) == 0; }
    int64_t place(int64_t number) const { return number >> shift; }
};

// Faces that may have perfect lobes, with their cumulative areas (count + 1).
struct MirrorFaces {
    const int32_t *face, *instance;
    const double* cumulative;
    int64_t count;
};

// Light from the point `light` to m_K = `last`, over further perfect lobes to m_1 = `first`, and to the
// surface `end`, for each sample. Distant light has a point far off. `weight` is 0 where there is none.
struct BeamPaths {
    float *light[3], *last[3], *first[3], *end[3];
    float *weight, *distance;  // distance: from the light to m_K, infinite if it is distant
};

// A vertex of a camera path for each sample. `weight` is 0 where there is none.
struct SeenPlaces {
    float *position[3], *weight;
};

struct LightNode;  // scene/lights/light_view.h

// How much of the light that passes edges reaches places (boundary/samples/edge_reach.h).
struct EdgeReachTask {
    int32_t places;
    const float *position[3], *size2, *weight;  // by place
    // Whose light passes the edges: the top nodes of the lights; null: all directions.
    const LightNode* lights;
    int32_t light_count;
    // Segments of edges, in whole packets; `instance` may be null.
    const int32_t *edge, *instance;
    const float *u0, *u1;
    int64_t count;
    float* reach;  // by segment
};

constexpr int kBeamTargets = 16;

// Cells of space, each with points to which directions from there are aimed, since beams that pass through
// the cell come from these points or go to them.
struct BeamGridView {
    const int32_t* slot;  // by cell; -1: no beam passes; null: there are no beams
    // (slots, kBeamTargets, 4): the point, and the width of directions to it. The first width is 0 where no
    // directions are aimed.
    const float* targets;
    float low[3], inverse;  // of the grid; of a cell's side
    int32_t count[3];
};

// Segments of candidate edges (boundary/curves/candidates.h), and samples [first, first + count) of `total`
// systematic ones over their summed weight.
struct BoundaryTask {
    const int32_t* edge;
    const int32_t* instance;  // -1: none; null: none has one
    const float* u0;
    const float* u1;
    const SegmentCell* cell;   // null: none; of a light, u0 and u1 are in turns about it
    int32_t direction_cells;   // per side: of cosines and azimuths, or of rows and columns of the picture
    const int32_t* parts;      // null: every entry is one segment (boundary/curves/candidates.h)
    const double* cumulative;  // (entries + 1) weight
    int64_t entries;
    int64_t first, count, total;
    int32_t max_depth;
    uint32_t seed;
    BoundaryKind kind;
    BounceLimits limits;
    // The summed weight is divided into equal shares. (shares + 1) cumulative numbers of samples per share;
    // null: all shares get equal numbers. Samples are scaled by `scale`. `score`, if not null, receives the
    // size of each sample.
    const double* guide;
    int64_t shares;
    float scale;
    float* score;
    // Lobes that the camera sees belong to camera-sampled samples (kCameraSampledIndirect and
    // kCameraSampledShadow) if their alpha is at most this. Camera-sampled samples find edges in the tree.
    float camera_sampled;
    EdgeTreeView tree;
    float from_camera;    // samples of kCameraSampledShadow per sample of the picture
    bool shares_faces;    // samples from edges and from the camera share the shadows of emissive meshes
    MirrorFaces mirrors;  // of kCausticEdge
    // Of kCausticEdge, by edge: shading continues across it, so that nothing jumps but at a silhouette.
    const uint8_t* continues;
    // Of kCausticEdge, aimed at lights, and of kIndirectBoundary, at mirrors that throw light
    BeamGridView beams;
    SampleRecord record;
    DroppedSamples* dropped;
};

}  // namespace edgegrad
