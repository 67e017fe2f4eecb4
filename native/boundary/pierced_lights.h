// Lines along which surfaces pass through what gives light.
#pragma once

#include "boundary/crossings.h"

namespace edgegrad {

// Those crossings of which one face is in `emissive` (by face, -1: it gives no light; null: none does), and
// the lines along which meshes, and copies of instanced ones, pass through rectangles and ellipses of the
// light table, where one of the two moves.
Crossings find_pierced_lights(const SceneTables& tables, const Asked& asked, const Crossings& crossings,
                              const int32_t* emissive, int threads);

}  // namespace edgegrad
