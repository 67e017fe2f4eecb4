// Finite emitters of the shadow boundary, with the distribution by which one is picked per edge sample (paths
// have scene/light_list.h).
#pragma once

#include "scene/tables.h"

namespace edgegrad {

struct EmitterTable {
    explicit EmitterTable(const SceneTables& tables);

    std::vector<int32_t> kind, index;
    std::vector<float> cdf;
};

}  // namespace edgegrad
