// Input and output of the kernels of the specular boundary (boundary/specular/scan_lines.h).
#pragma once

#include <cstdint>

#include "tasks/image_task.h"

namespace edgegrad {

// The largest number of surfaces of a chain: mirrors, smooth glass, transparent surfaces, and its end.
constexpr int kMostChain = 16;

// Length of a segment of a scan line, pixels. Features narrower than a segment are found with a probability
// of their width over its length.
constexpr float kScanSegment = 0.25f;
// The number of segments of a line across a tile whose side is `tile` pixels. A line begins up to two
// segments before the tile.
constexpr int32_t scan_line_segments(float tile) {
    return 2 * (static_cast<int32_t>(tile / (2.0f * kScanSegment)) + 1);
}

// Scan lines over the picture, divided into numbered segments: for each tile those of the horizontal lines,
// then those of equally many vertical lines.
struct ScanTask {
    const int32_t *region, *face_edge, *next_on_side;  // boundary/meshes/surface_regions.h
    const int64_t* tile_first;                         // cumulative number of segments by tile
    const int32_t* tile_lines;                         // of each direction
    int32_t columns, rows;                             // of tiles
    float tile;                                        // side of a tile, pixels
    bool guides;            // crossings only guide another pass: lines also find lights that they pass nearby
    int64_t first, count;   // segments, both even
    float low[2], high[2];  // the scanned region, pixels
    uint32_t seed;
    // Which edges are computed: edges seen by chains, edges of shadows on surfaces seen by chains, and edges
    // between such a surface and others that light it. `outlines`: those of lights of the table seen by
    // chains.
    bool edges, lights, surfaces, outlines;
    BounceLimits limits;
    int32_t max_depth;
};

// Intersections of scan lines with the edges' images in the picture.
struct ChainCrossings {
    float *x, *y, *lens_u, *lens_v;  // place in the picture, and on the lens (CameraSamples)
    int32_t *segment, *horizontal;
    int32_t* length;  // vertices of the chain before the edge
    // Whether the edge separates two faces of one smooth mesh at the last vertex, such that the chain leaves
    // one face, and enters the body of the other.
    int32_t* parted;
    // By vertex of the chain: its place, its closure, and its scattering event (boundary/specular/chain.h).
    int32_t *face[kMostChain], *mesh[kMostChain], *instance[kMostChain];
    int32_t *closure[kMostChain], *event[kMostChain];
    float *b1[kMostChain], *b2[kMostChain];
    float* half[3][kMostChain];  // microfacet normal of a followed lobe
    // The curve. Without any of these it is the horizon of the last vertex' face:
    int32_t *edge, *edge_instance;  // an edge; -1: none
    float* u;                       // place along the edge
    int32_t* field;                 // the face that stands for a field, whose outline it is; -1: none
    int32_t *crossed_face[2], *crossed_instance[2];  // two surfaces that pass through each other; -1: none
    int32_t* outlined_light;                         // the row of the light whose outline it is; -1: none
    float* curve_point[3];                           // of outlines and of lines of two surfaces
    float *outline_normal[3], *contact;              // of outlines (sdf/outline_point.h)
    float* weight;                                   // of the random decisions and of the scan lines
    float* from[3];                                  // origin of the last ray
    int32_t* seen;                                   // whether the edge is visible from there
    float* jump[3];                                  // L- - L+, with the chain's throughput
    float* by_point[3];  // derivatives of -g by `from` and by the last ray's direction
    float* by_direction[3];
    float* direction[3];  // of the last ray, if it leaves a face along its horizon
    float* by_screen[2];  // of g by the place in the picture
    // If the last ray goes from the chain's last vertex to a light (boundary/specular/chain_light.h):
    int32_t* lit;
    int32_t *light_row, *light_kind, *light_face, *light_instance, *light_scatters;
    int32_t *light_blockers, *light_visible_to;
    float *light_b1, *light_b2, *light_place[3], *light_density;
};

}  // namespace edgegrad
