// The faces of some materials, those that may have perfect lobes, in place of edges.
#pragma once

#include <cstdint>
#include <vector>

#include "boundary/curves/candidates.h"
#include "scene/view.h"

namespace edgegrad {

// Weighted by area. With `lit`, times the irradiance that the sized lights of the table may have there.
// `bends`: 1 for the materials, else 0.
Candidates mirror_faces(const SceneView& scene, const SceneTables& tables, const std::vector<uint8_t>& bends,
                        bool lit);

}  // namespace edgegrad
