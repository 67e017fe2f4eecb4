// Absorption in closed meshes: Beer's law along the segments of a path that lie within the mesh.
//
// A segment lies within a mesh if it arrives at the back of its surface. The absorption (1/m) is that of the
// closure at which it arrives; all closures of a material have the same. What stands inside of the mesh is
// reached without absorption. Shadow rays pass transparent surfaces in any order: those at whose back they
// arrive count with the whole way to there, those at whose front they arrive take it off again.
#pragma once

#include "scene/geometry.h"
#include "scene/material_params.h"

namespace edgegrad::EDGEGRAD_ISA {

EG_INLINE Float length_of(Vec3 a) { return sqrt(max(dot(a, a), 1e-30f)); }

// Beer's law.
EG_INLINE Vec3 kept_over(Vec3 depth) { return {exp(-depth.x), exp(-depth.y), exp(-depth.z)}; }
EG_INLINE Vec3 kept_over(Vec3 extinction, Float distance) {
    const auto depth = [&](Float e) { return select(e > 0.0f, e * distance, splat(0.0f)); };  // 0 * inf is 0
    return kept_over(Vec3{depth(extinction.x), depth(extinction.y), depth(extinction.z)});
}

// The absorption behind a closure's surface. `absorbs` are the lanes that have one.
EG_INLINE Vec3 absorption_of(const SceneView& scene, Mask active, Int closure, Mask& absorbs) {
    closure = select(active, closure, splat(0));
    absorbs = active & ((gather(scene.closure_flags, closure) & static_cast<int32_t>(kHasAbsorption)) != 0);
    if (!any(absorbs)) return zero3();
    Float values[3];
    gather_row(scene.closure_params + kAbsorption, kMaterialParams, closure, values);
    return {values[0], values[1], values[2]};
}

// The share of light that is left at x after `distance` within the mesh; 1 if x is seen from outside.
EG_INLINE Vec3 kept_inside(const SceneView& scene, const SurfacePoint& x, Int closure, Float distance) {
    const Vec3 all = one3();
    if (!(scene.all_flags & kHasAbsorption)) return all;
    Mask inside;
    const Vec3 a = absorption_of(scene, x.active & (x.side < 0.0f), closure, inside);
    if (!any(inside)) return all;
    return select(inside, kept_over(a * distance), all);
}

}  // namespace edgegrad::EDGEGRAD_ISA
