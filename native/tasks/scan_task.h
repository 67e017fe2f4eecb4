// What the kernels of the specular boundary (boundary/specular/scan_lines.h) read and write.
#pragma once

#include <cstdint>

#include "tasks/image_task.h"

namespace edgegrad {

// Most surfaces of a chain of mirrors, smooth glass and transparent surfaces, its end included.
constexpr int kMostChain = 16;

// Length of a segment of a scan line, pixels. Features narrower than a segment are missed.
constexpr float kScanSegment = 0.25f;
// Side of a tile, pixels, and the segments of a line over it, which begins up to two before it.
constexpr float kScanTile = 4.0f;
constexpr int32_t kScanLine = 2 * (static_cast<int32_t>(kScanTile / (2.0f * kScanSegment)) + 1);

// Scan lines over the picture, cut into segments with numbers: tile by tile those of the horizontal lines,
// then those of as many vertical ones.
struct ScanTask {
    const int32_t *region, *face_edge;  // boundary/meshes/surface_regions.h
    const int64_t* tile_first;          // segments before each tile's, and of all
    const int32_t* tile_lines;          // of each direction
    int32_t columns, rows;              // of tiles
    int64_t first, count;               // segments, both even
    float low[2], high[2];              // what is scanned, pixels
    float scale;                        // what the pass counts for
    uint32_t seed;
    // Whether the edges that chains show are computed, those of shadows there, and those between a surface
    // that they show and others that light it.
    bool edges, lights, surfaces;
    BounceLimits limits;
    int32_t max_depth;
};

// Crossings of scan lines with the picture of edges, one behind the other.
struct ChainCrossings {
    float *x, *y, *lens_u, *lens_v;  // where in the picture, and on the lens (CameraSamples)
    int32_t *segment, *horizontal;
    int32_t* length;  // vertices of the chain before the edge
    // Whether the edge parts faces of one smooth mesh at the last vertex, one of which the chain leaves while
    // the other sends it into itself.
    int32_t* parted;
    // By vertex of the chain: where, which shader, and what becomes of the ray (boundary/specular/chain.h).
    int32_t *face[kMostChain], *mesh[kMostChain], *instance[kMostChain];
    int32_t *closure[kMostChain], *event[kMostChain];
    float *b1[kMostChain], *b2[kMostChain];
    float* half[3][kMostChain];     // the microfacet's normal, of a followed lobe
    int32_t *edge, *edge_instance;  // -1: the horizon of the last vertex' face
    float* u;                       // place along the edge
    float* weight;                  // of random decisions and of the scan lines
    float* from[3];                 // where the last ray comes from
    int32_t* seen;                  // whether the edge is seen from there
    float* jump[3];                 // L- - L+, with the chain's throughput
    float* by_point[3];             // derivatives of -g by `from` and by the last ray's direction
    float* by_direction[3];
    float* direction[3];  // of the last ray, where it leaves a face along its horizon
    float* by_screen[2];  // of g by the place in the picture
    // Where the last ray goes to a light from the chain's last vertex (boundary/specular/chain_light.h).
    int32_t* lit;
    int32_t *light_row, *light_kind, *light_face, *light_instance, *light_scatters;
    int32_t *light_blockers, *light_visible_to;
    float *light_b1, *light_b2, *light_place[3], *light_density;
};

}  // namespace edgegrad
