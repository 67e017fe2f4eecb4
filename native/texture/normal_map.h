// Normal maps, and the tangents that they and anisotropy are relative to.
#pragma once

#include "scene/view.h"
#include "texture/point.h"

namespace edgegrad::EDGEGRAD_ISA {

// The normal that a leaf's normal map (its colour, in [0, 1]) bends the smooth one to, unit, on the viewer's
// side; `point.normal` where the leaf has none.
EG_INLINE Vec3 shading_normal(const SceneView& scene, Mask active, Int leaf, const TexturePoint& point,
                              Vec3 color, Float strength) {
    (void)scene, (void)active, (void)leaf, (void)color, (void)strength;
    return point.normal;
}

// Unit direction of anisotropy, perpendicular to the normal n.
EG_INLINE Vec3 surface_tangent(const SceneView& scene, Mask active, Int leaf, const TexturePoint& point,
                               Vec3 n) {
    (void)scene, (void)active, (void)leaf, (void)point;
    Vec3 a, b;
    basis(n, a, b);
    return a;
}

}  // namespace edgegrad::EDGEGRAD_ISA
