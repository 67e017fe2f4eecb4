// The point at which a texture is evaluated.
#pragma once

#include "simd/vector.h"

namespace edgegrad::EDGEGRAD_ISA {

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
};

}  // namespace edgegrad::EDGEGRAD_ISA
