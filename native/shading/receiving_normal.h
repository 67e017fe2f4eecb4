// The plane above which a surface receives light from emitter samples.
#pragma once

#include "scene/geometry.h"

namespace edgegrad::EDGEGRAD_ISA {

// The normal that decides, beside the geometric one, whether emitter samples reach x: the shading normal of
// meshes with a `terminator_offset`. As in Cycles, such meshes also receive light from below a triangle's
// plane, from emitter samples alone: scattered rays still stay above the plane. Elsewhere it is the geometric
// normal.
EG_INLINE Vec3 receiving_normal(const SceneView& scene, const SurfacePoint& x, Vec3 shading) {
    if (!scene.any_terminator) return x.normal;
    return select(gather(scene.mesh_terminator, x.mesh) > 0.0f, shading, x.normal);
}

}  // namespace edgegrad::EDGEGRAD_ISA
