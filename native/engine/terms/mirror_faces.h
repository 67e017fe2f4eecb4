// The faces that may have perfect lobes, in place of edges.
#pragma once

#include "boundary/curves/candidates.h"
#include "scene/view.h"

namespace edgegrad {

// Weighted by area. With `lit`, times the irradiance that the sized lights of the table may have there.
Candidates mirror_faces(const SceneView& scene, const SceneTables& tables, bool lit);

}  // namespace edgegrad
