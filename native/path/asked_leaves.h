// Shaders that derivatives are asked of. Where nothing else has any, paths that haven't met one yet are
// followed but neither recorded nor lit.
#pragma once

#include <cstdint>

namespace edgegrad {

struct AskedLeaves {
    bool everywhere = true;
    int32_t first = 0, last = 0;
    int32_t lobes = 0;  // of those (bits): all that is asked for is how wide these lobes are
};

}  // namespace edgegrad
