// Light of a fixed direction: the differentiation of light from moving emissive meshes at surfaces with sharp
// lobes.
//
// In material form the points y of a light move with its triangles. A sample changes by the divergence of F
// dw/dtheta, F = f |n . w| L_e. If L_e is constant, the integral of this over a triangle is an integral along
// its borders, which cancels between neighbours. So samples are as large as 1/(size of the triangles) and
// 1/(alpha r), although their mean is zero except at outlines. With a fixed direction w instead of a fixed
// point y, only the light's outline as seen from x changes (boundary/terms/emitter_outline.h). Both forms
// differ by a divergence, whose borders are that outline and those of occluders in front of the mesh
// (derivations, K).
//
// A derivative call chooses the form by the materials of x and the meshes (engine/call_scene.cpp), the same
// for all terms. Meshes of few faces and diffuse receivers stay in material form, because there the outline
// is noisier than the interior.
#pragma once

#include "scene/geometry.h"

namespace edgegrad::EDGEGRAD_ISA {

// Returns the lanes in which x's material may receive light of a fixed direction.
EG_INLINE Mask receives_held(const SceneView& scene, Mask active, Int material) {
    if (!scene.face_fixed_direction) return splat(0);
    return active & (gather(scene.material_fixed_direction, select(active, material, splat(0))) != 0);
}

// Returns the lanes in which light from these faces to x is differentiated at a fixed direction.
EG_INLINE Mask holds_direction(const SceneView& scene, Mask active, Int face, Int material) {
    if (!scene.face_fixed_direction) return splat(0);
    const Mask some = receives_held(scene, active & (face >= 0), material);
    return some & (gather(scene.face_fixed_direction, select(some, face, splat(0))) != 0);
}

}  // namespace edgegrad::EDGEGRAD_ISA
