// Bounds of the values that texture programs compute.
#pragma once

#include "scene/tables.h"

namespace edgegrad {

// Sets lower bounds of the roughness of each closure and of its coat, in turn, over all shading points: the
// row's own value where no texture computes it, and minus infinity where nothing is known. Also finds the
// hues that may leave [0, 1] (TextureTables::leaving_hues). Images and attributes are read once, if some of
// these values needs theirs, until other textures take their place (TextureTables::image_range,
// attribute_range).
void bound_values(SceneTables& tables);

}  // namespace edgegrad
