// The meshes between which the direction of light is fixed near contact (scene/contact.h).
#pragma once

#include <vector>

#include "scene/tables.h"

namespace edgegrad {

struct MaterialJumps;  // scene/textures/jumps.h

// Bits (kContactFrom and others) by mesh, from those by material. Empty if no light qualifies. Emission and
// scattering at y must not jump within a face, except at borders of cells (scene/textures/jumps.h). Neither y
// nor x may be transparent or have a perfect lobe, because points behind those stay in material form.
std::vector<int32_t> contact_meshes(const SceneTables& tables, const std::vector<int32_t>& materials);

// Bits by material, and the grids of cells at whose borders its textures jump: by material the first grid and
// the end, and by grid its attribute and (kCellCoordinates, 4) rows.
struct ContactMaterials {
    std::vector<int32_t> bits, first_grid, grid_attributes;
    std::vector<float> grid_rows;
};
ContactMaterials contact_materials(const SceneTables& tables, const MaterialJumps& jumps);
// By visible mesh, the longest side of the box around all its copies.
std::vector<float> mesh_sizes(const SceneTables& tables);

// Materials that keep meshes from having bits, of meshes that have concave edges or may touch others, and
// whose points move relative to those. Light between such faces has samples without a finite variance.
std::vector<int32_t> noisy_contact_materials(const SceneTables& tables, const RequestedMotion& motion,
                                             const std::vector<int32_t>& materials);

// Boxes around the scene's transparent faces, at most kTransparentBoxes: (B, 2, 3) lower and upper corners.
std::vector<float> transparent_boxes(const SceneTables& tables);

}  // namespace edgegrad
