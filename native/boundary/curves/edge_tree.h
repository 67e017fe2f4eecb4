// Hierarchy of edges, by which one near a given direction is picked as seen from a point: the nodes of lights
// (scene/lights/light_tree.h), whose axes are the normals of faces here.
#pragma once

#include "boundary/curves/candidates.h"
#include "tasks/edge_tree_view.h"

namespace edgegrad {

class EdgeTree {
 public:
    // Over candidate edges, the long ones cut into pieces; `emitters`: of faces for the light that they give.
    EdgeTree(const SceneView& scene, const SceneTables& tables, const Candidates& edges,
             bool emitters = false);

    EdgeTreeView view() const {
        return {nodes_.data(), top_.data(), static_cast<int32_t>(top_.size()), pieces_.data()};
    }

 private:
    std::vector<LightNode> nodes_;
    std::vector<int32_t> top_;
    std::vector<float> pieces_;
};

}  // namespace edgegrad
