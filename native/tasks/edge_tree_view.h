// Segments of edges as rows of floats, and the hierarchy over them (boundary/curves/edge_tree.h).
#pragma once

#include <cstdint>

#include "scene/view.h"

namespace edgegrad {

// Columns of a row of floats: a segment of an edge.
enum EdgeSegmentColumn : int32_t {
    kSegmentFrom = 0,   // first end of the whole edge
    kSegmentAlong = 3,  // from there to its second end
    kSegmentNormal =
        6,  // of two faces, so that the edge is a silhouette where their signs differ; 0: from all sides
    kSegmentU0 = 12,
    kSegmentU1 = 13,
    kSegmentEdge = 14,  // integers
    kSegmentInstance = 15,
    kSegmentColumns = 16
};
constexpr int32_t kMostTopNodes = 24;
struct EdgeTreeView {
    const LightNode* nodes;
    const int32_t* top;  // numbers of the nodes from which the search starts
    int32_t top_count;
    const float* pieces;  // (count, kSegmentColumns)
    float mass;           // sum of the weights of the edges
};

}  // namespace edgegrad
