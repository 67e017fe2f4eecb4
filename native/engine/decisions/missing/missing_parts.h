// Contributions to a derivative that are not computed and may not be zero: jumps of radiance without an
// estimator.
#pragma once

#include "engine/decisions/decisions.h"

namespace edgegrad {

// Notes the parts that occur in this call. `closed`: by mesh (boundary/meshes/solids.h).
void note_missing(const BoundaryFacts& facts, const Requested& requested, const std::vector<uint8_t>& closed,
                  int threads, Decisions& decided);

}  // namespace edgegrad
