// Between which meshes light is held where they nearly touch (scene/contact.h).
#pragma once

#include <vector>

#include "scene/tables.h"
#include "scene/view.h"

namespace edgegrad {

// Bits kContactFrom and the like by mesh; none where nothing moves over surfaces, or no light is held. What
// the y of scene/contact.h gives and scatters has no jumps, as textures may have; neither it nor x has a
// perfect lobe, behind which points ride. Where meshes hold all of their light
// (shading/lights/fixed_direction_light.h), or surfaces let light pass, nothing else is held.
std::vector<int32_t> contact_meshes(const SceneTables& tables, const SceneView& view,
                                    const RequestedMotion& motion);

}  // namespace edgegrad
