// Light hierarchy: a binary tree over lights, by which one is picked in proportion to what it may give.
#pragma once

#include <vector>

#include "scene/lights/light_view.h"

namespace edgegrad {

// Bound of two groups together.
LightNode united(const LightNode& a, const LightNode& b);

// The tree over single lights (`child` of each is set): its root first, then an unused node, then pairs of
// siblings. `parent` of the root is -1; pairs' `child` and `parent` count from `offset`, where the root goes.
std::vector<LightNode> light_tree(std::vector<LightNode> lights, int32_t offset);

}  // namespace edgegrad
