// The surfaces whose derivatives are requested. If only surfaces have derivatives, a path that has not met a
// requested one yet is traced, but records no vertices and samples no lights.
#pragma once

#include <cstdint>

namespace edgegrad {

struct RequestedSurfaces {
    bool everywhere = true;
    int32_t first_closure = 0, last_closure = 0;  // range of the requested closures
    int32_t lobes = 0;  // bits of lobes, if only the roughness of these lobes is requested
    // Vertices of faces or distance fields are requested (SceneView::face_moving). A vertex that scatters
    // light from such a face depends on its motion, so that vertices whose next vertex may lie on a moving
    // face are recorded as well.
    bool moving = false;
    // A Lambertian surface that the camera sees in light of a constant environment has no derivative where
    // the sampled direction is not occluded: nothing but motion is requested, and no value of a surface
    // depends on its place (adjoint/vertex.h, scattered_by_lambertian).
    bool even_light = false;
};

}  // namespace edgegrad
