// Finite emitters with the distribution by which one is picked per shading point.
#pragma once

#include "scene/tables.h"

namespace edgegrad {

struct EmitterTable {
    // `asked` null: for the picture alone.
    EmitterTable(const SceneTables& tables, const Asked* asked);

    std::vector<int32_t> kind, index;
    std::vector<float> cdf;
};

}  // namespace edgegrad
