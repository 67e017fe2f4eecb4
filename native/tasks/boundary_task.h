// Samples of one boundary kind, as its kernels take them.
#pragma once

#include <cstdint>

#include "tasks/boundary_kind.h"
#include "tasks/dropped_samples.h"
#include "tasks/edge_tree_view.h"
#include "tasks/image_task.h"

namespace edgegrad {

// What a segment is of besides its part of an edge: by its kind's domain (tasks/boundary_kind.h) a cell of
// directions about the edge, a cell of the picture, or a light instead of the edge. And whether the camera
// sees its samples by way of other surfaces.
class SegmentCell {
 public:
    SegmentCell() = default;
    constexpr SegmentCell(int32_t place, bool chained) : bits_(place | (chained ? kChained : 0)) {}
    constexpr bool chained() const { return bits_ & kChained; }
    // Of direction_cells^2 cells, row by row; of curves about lights the row of the light.
    constexpr int32_t place() const { return bits_ & ~kChained; }

 private:
    static constexpr int32_t kChained = 1 << 30;
    int32_t bits_;
};

// What later calls learn from a term's samples (boundary/curves/learned_weights.h): the contribution of each,
// the expected number of samples on its segment, which segment that is (entry of the list, and cell), and
// where on the edge it lies.
struct SampleRecord {
    int32_t shift;                      // of 2^shift samples one is recorded
    float *contribution, *density, *u;  // null: nothing is learned
    int32_t* entry;                     // of the list of segments
    SegmentCell* cell;

    // Whether sample `number` is recorded, and where.
    bool has(int64_t number) const { return contribution && (number & ((int64_t{1} << shift) - 1)) == 0; }
    int64_t place(int64_t number) const { return number >> shift; }
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
    // The weight is cut into equal shares; how many of the samples go to those before each (shares + 1);
    // null: to all alike. Samples are scaled by `scale`; `score`, if not null, takes the size of each one.
    const double* guide;
    int64_t shares;
    float scale;
    float* score;
    // Lobes of an alpha up to this, where the camera sees them, are left to the samples that start there
    // (kCameraSampledIndirect), or are theirs; these find edges in the tree.
    float camera_sampled_alpha;
    EdgeTreeView tree;
    SampleRecord record;
    DroppedSamples* dropped;
};

}  // namespace edgegrad
