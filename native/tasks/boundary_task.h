// Samples of one boundary kind, as its kernels take them.
#pragma once

#include <cstdint>

#include "tasks/boundary_kind.h"
#include "tasks/dropped_samples.h"
#include "tasks/edge_tree_view.h"
#include "tasks/image_task.h"

namespace edgegrad {

// Flag of a piece's cell: of segments that the camera sees by way of other surfaces.
constexpr int32_t kChained = 1 << 30;

// What becomes of a term's samples, for what later calls learn from them
// (boundary/curves/learned_weights.h): what the sample is worth, the expected number of samples on its piece,
// which piece that is (the entry of the list that it belongs to, and its cell), and where on the edge.
struct SampleRecord {
    int32_t shift;                      // of 2^shift samples one is recorded
    float *contribution, *density, *u;  // null: nothing is learned
    int32_t *entry, *cell;              // of the list of pieces; its direction cell

    // Whether sample `number` is recorded, and where.
    bool has(int64_t number) const { return contribution && (number & ((int64_t{1} << shift) - 1)) == 0; }
    int64_t place(int64_t number) const { return number >> shift; }
};

// Pieces of candidate edges (boundary/curves/candidates.h), and samples [first, first + count) of `total`
// systematic ones over their summed mass.
struct BoundaryTask {
    const int32_t* edge;
    const int32_t* instance;  // -1: none; null: none has one
    const float* u0;
    const float* u1;
    // Of direction_cells^2 directions about the edge (cosines, and azimuths), or, of samples that start at
    // the camera, of as many cells of the picture; and kChained. Null: none. Of kConeBorder and kLightOutline
    // instead of an edge the light, in turns about which u0 and u1 are.
    const int32_t* cell;
    int32_t direction_cells;
    const int32_t* parts;      // null: every entry is one piece (boundary/curves/candidates.h)
    const double* cumulative;  // (entries + 1) mass
    int64_t entries;
    int64_t first, count, total;
    int32_t max_depth;
    uint32_t seed;
    BoundaryKind kind;
    BounceLimits limits;
    // The mass cut into equal shares, and how much of the samples goes to those before each (shares + 1);
    // null: to all alike. What samples count for is scaled by `scale`; `score`, if not null, takes the size
    // of each one.
    const double* guide;
    int64_t shares;
    float scale;
    float* score;
    // Lobes of an alpha up to this, where the camera sees them, are the aimed estimator's, with the edges of
    // the tree; from kAimAtAll on all light is.
    float aimed;
    EdgeTreeView tree;
    SampleRecord record;
    DroppedSamples* dropped;
};
constexpr float kAimAtAll = 1e3f;

}  // namespace edgegrad
