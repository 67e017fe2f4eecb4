// Surfaces that derivatives are asked of. Where nothing else has any, paths that haven't met one yet are
// followed but neither recorded nor lit.
#pragma once

#include <cstdint>

namespace edgegrad {

struct RequestedSurfaces {
    bool everywhere = true;
    int32_t first_closure = 0, last_closure = 0;  // by their shaders
    int32_t lobes = 0;  // of those (bits): all that is asked for is how wide these lobes are
    // By their vertices (SceneView::face_moving). What scatters light of such a surface sees it move, so that
    // vertices are recorded whose next one may be on one.
    bool moving = false;
};

}  // namespace edgegrad
