// Finite emitters of derivatives, with the distribution by which one is picked per shading point (pictures
// have scene/light_list.h).
#pragma once

#include "scene/tables.h"

namespace edgegrad {

struct EmitterTable {
    EmitterTable(const SceneTables& tables, const Asked& asked);

    std::vector<int32_t> kind, index;
    std::vector<float> cdf;
};

}  // namespace edgegrad
