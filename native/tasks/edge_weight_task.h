// What the kernel of edges' weights (boundary/curves/edge_weights.h) reads and writes.
#pragma once

#include <cstdint>

namespace edgegrad {

// Tiles along each side of the picture: bits of their number.
constexpr uint32_t kTileBits = 6;

// What edges are weighed by: what they sweep in the picture, or the light that they may hide.
enum EdgeWeightKind : int32_t { kPictureWeight, kLightWeight, kEnvironmentWeight };

// Edges [first, first + count) of one mesh, where one instance places them (-1: they stand in the world).
struct EdgeWeightTask {
    EdgeWeightKind kind;
    int32_t instance;
    int64_t first, count;
    const float* normal;  // (F, 3) of faces as they are wound, unit; 0 where they have no area
    const uint8_t*
        seam;  // by edge from `first` on; null: found where it matters, of the edges that are `flat`
    // The mesh of these edges if it hides nothing of the light that its own faces give (convex_meshes.h),
    // else -2; and by node on top of the lights, the mesh whose faces alone it consists of, or -1.
    int32_t clear_mesh;
    const int32_t* light_mesh;
    int32_t solid_side;  // boundary/meshes/solids.h
    bool sharp;          // shadows of lights without size
    bool cut_all;        // all edges are to be cut to the frame
    float lens_reach;    // PictureFrame
    float margin;
    // By edge from `first` on, in whole packets. The weight, in the picture per pixel; `pixels`: the edge's
    // length there; the tile of its middle along a Z-order curve. Less than 0: the edge must be cut to the
    // frame first.
    float *mass, *pixels;
    int32_t* tile;
    int32_t* flat;  // -1: the weight counts only if a seam is there
};

}  // namespace edgegrad
