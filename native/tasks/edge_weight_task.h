// Input and output of the kernel that computes weights of edges (boundary/samples/edge_weights.h).
#pragma once

#include <cstdint>

namespace edgegrad {

// Logarithm to the base 2 of the number of tiles along each side of the picture.
constexpr uint32_t kTileBits = 6;

// Faces whose normals differ by less than this sine count as coplanar.
constexpr float kCoplanar = 1e-6f;

// Narrower wedges of directions in which an edge is a silhouette are not sampled separately if other
// directions count as well. Rounding would decide whether their directions are inside.
constexpr float kLeastWedge = 1e-3f;

// Weights of edges: by the area that they sweep in the picture, by the light that they may occlude, or by
// that of their own faces.
enum EdgeWeightKind : int32_t { kPictureWeight, kLightWeight, kEnvironmentWeight, kBorderWeight };

// Edges [first, first + count) of one mesh, where one instance places them (-1: they stand in the world).
struct EdgeWeightTask {
    EdgeWeightKind kind;
    int32_t instance;
    int64_t first, count;
    const float* normal;  // (F, 3) unit normals of the faces' winding; 0 for faces without area
    const uint8_t* seam;  // by edge from `first` on; null: found later, for edges that are `flat`
    // The mesh of these edges if it occludes none of the light that its own faces emit (convex_meshes.h),
    // else -2. For each top node of the lights the mesh to which all of its faces belong, or -1.
    int32_t clear_mesh;
    const int32_t* light_mesh;
    int32_t solid_side;  // boundary/meshes/solids.h
    bool sharp;          // shadows of lights without size
    bool cut_all;        // all edges must be clipped to the frame
    float lens_reach;    // PictureFrame
    float margin;
    // By edge from `first` on, in whole packets: the weight, in the picture per pixel; `pixels`, the edge's
    // length in the picture; the tile of its middle along a Z-order curve. Negative `pixels` mean that
    // the edge must be clipped to the frame first.
    float *mass, *pixels;
    int32_t* tile;
    int32_t* flat;  // -1: the weight counts only if a seam is there
};

}  // namespace edgegrad
