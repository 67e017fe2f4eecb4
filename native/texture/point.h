// The point at which a texture is evaluated.
#pragma once

#include "simd/vector.h"

namespace edgegrad::EDGEGRAD_ISA {

// What a ray has passed through before it met a surface. Without a record, bounces are those of the ray's
// kind alone, and the length is 0.
struct RayHistory {
    Int bounces;   // counts as in path/path_queue.h; -1: not recorded
    Float length;  // from the last scattering event
};
EG_INLINE RayHistory unknown_history() { return {splat(-1), splat(0.0f)}; }

struct TexturePoint {
    Int face;
    Int instance;      // row of SceneView::instance_to_world, -1: none
    Float b1, b2;      // barycentrics of the second and third corner
    Vec3 position;     // relative to the tables' origin
    Vec3 normal;       // unit, smooth, on the viewer's side
    Vec3 view;         // unit, towards the ray's origin
    Mask backside;     // the viewer sees the clockwise side
    Int ray_kind;      // RayKind; kNoRay: an emitter sample
    Vec3 true_normal;  // unit, geometric, on the viewer's side
    Vec3 undisplaced;  // `normal` without the bump of the material's displacement
    RayHistory history = unknown_history();
};

EG_INLINE TexturePoint without_history(TexturePoint point) {
    point.history = unknown_history();
    return point;
}

}  // namespace edgegrad::EDGEGRAD_ISA
