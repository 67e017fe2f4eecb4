// The meshes between which the direction of light is fixed near contact (scene/contact.h).
#pragma once

#include <vector>

#include "scene/tables.h"
#include "scene/view.h"

namespace edgegrad {

// Bits (kContactFrom and others) by mesh. Empty if no surface moves relative to another, or if no light
// qualifies. Emission and scattering at y must not jump within a face, as textures may do. Neither y nor x
// may have a perfect lobe, because points behind those stay in material form. Scenes in which emissive meshes
// have a fixed direction anyway (shading/lights/fixed_direction_light.h), and scenes with transparent
// surfaces, get no bits.
std::vector<int32_t> contact_meshes(const SceneTables& tables, const SceneView& view,
                                    const RequestedMotion& motion);

}  // namespace edgegrad
