// Borders that the camera's clip distances cut into meshes.
#pragma once

#include <cstddef>

#include "boundary/meshes/trees/face_tree.h"
#include "scene/tables.h"
#include "scene/view.h"

namespace edgegrad {

// Whether a mesh in this box may cross a clip distance.
bool may_be_cut(const CameraView& c, const Box& box);

// Whether the camera may see the border that a clip distance cuts into a mesh.
bool is_cut(const CameraView& c, const SceneTables& t, size_t mesh);

}  // namespace edgegrad
