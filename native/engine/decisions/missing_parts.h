// What may not be zero in a derivative and isn't computed: jumps of the picture that no part covers.
#pragma once

#include "engine/decisions/decisions.h"

namespace edgegrad {

// Notes such parts; those that are not noted don't occur. `closed`: by mesh (boundary/meshes/solids.h).
void note_missing(const BoundaryFacts& facts, const Requested& requested, const std::vector<uint8_t>& closed,
                  int threads, EdgeCache& kept, Decisions& decided);

}  // namespace edgegrad
