// A hierarchy of edges, from which a shading point samples an edge near a given direction. It uses the nodes
// of the light tree (scene/lights/light_tree.h); a node's axis is here the axis of the cone of face normals.
#pragma once

#include "boundary/curves/candidates.h"
#include "tasks/edge_tree_view.h"

namespace edgegrad {

class EdgeTree {
 public:
    // Builds the tree over candidate edges, cutting long ones. `emitters`: the edges bound emissive faces.
    EdgeTree(const SceneView& scene, const SceneTables& tables, const Candidates& edges,
             bool emitters = false);

    EdgeTreeView view() const {
        return {nodes_.data(), top_.data(), static_cast<int32_t>(top_.size()), segments_.data(), mass_};
    }

 private:
    std::vector<LightNode> nodes_;
    std::vector<int32_t> top_;
    std::vector<float> segments_;
    float mass_;
};

}  // namespace edgegrad
