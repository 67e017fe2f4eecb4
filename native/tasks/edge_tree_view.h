// Segments of edges as rows of floats, and the hierarchy over them (boundary/curves/edge_tree.h).
#pragma once

#include <cstdint>

#include "scene/view.h"

namespace edgegrad {

// Pieces of edges as rows of floats, and nodes over them (boundary/curves/edge_tree.h).
enum EdgePieceColumn : int32_t {
    kPieceFrom = 0,   // the whole edge: its first end,
    kPieceAlong = 3,  // and from it to the second
    kPieceNormal =
        6,  // of two faces, so that the edge is a silhouette where their signs differ; 0: from all sides
    kPieceU0 = 12,
    kPieceU1 = 13,
    kPieceEdge = 14,  // integers
    kPieceInstance = 15,
    kPieceColumns = 16
};
constexpr int32_t kMostTopNodes = 24;
struct EdgeTreeView {
    const LightNode* nodes;
    const int32_t* top;  // numbers of nodes of which one is picked first
    int32_t top_count;
    const float* pieces;  // (count, kPieceColumns)
};

}  // namespace edgegrad
