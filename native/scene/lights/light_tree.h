// Light hierarchy: a binary tree over lights, from which one is chosen in proportion to its bound.
#pragma once

#include <vector>

#include "scene/lights/light_view.h"

namespace edgegrad {

// The bound of two nodes together.
LightNode united(const LightNode& a, const LightNode& b);

// Builds the tree over single lights, whose `child` is set. The first node is the root, the second is unused,
// then come pairs of siblings. `parent` of the root is -1. The pairs' `child` and `parent` are indices from
// `offset`, where the root will be stored.
std::vector<LightNode> light_tree(std::vector<LightNode> lights, int32_t offset);

}  // namespace edgegrad
