// Light whose direction is held: how what moving emissive meshes give to surfaces of sharp lobes is
// differentiated.
//
// In material form a light's points y ride on its triangles, and a sample of it changes with the divergence
// of F dw/dtheta, F = f |n . w| L_e. Where L_e is one constant, the integral of that over a triangle is one
// along its borders, which cancels between neighbours: samples bring numbers as large as 1/(the triangles'
// size) and 1/(alpha r), whose mean is zero but at outlines. With w held instead of y nothing of the light
// changes but where its outline is, as x sees it (boundary/terms/emitter_outline.h). The rates of both forms
// differ by a divergence, whose borders are that outline and those of what is in front of the mesh
// (derivations, K). The form is a call's choice (engine/call_scene.cpp) by the material of x and the mesh,
// and one for all terms.
//
// Seconds x variance of a gradient of all vertices, held by riding, under a sheet of 2, 8, 18, 32, 72 faces:
// alpha .04 .11, .08, .07, .03, .02; alpha .16 4.9, 1.0, .30, .07, .05; of pictures of a mesh that moves as a
// whole .03 and 1 to 3. On diffuse surfaces gradients gain from 32 faces on (.2 at 72), pictures lose 10 to
// 60 times: these ride.
#pragma once

#include "scene/geometry.h"

namespace edgegrad::EDGEGRAD_ISA {

// Whether x's material is one to which light may come in a direction that is held.
EG_INLINE Mask receives_held(const SceneView& scene, Mask active, Int material) {
    if (!scene.face_held) return splat(0);
    return active & (gather(scene.material_held, select(active, material, splat(0))) != 0);
}

// Whether the light that these faces give to x is differentiated with its direction held.
EG_INLINE Mask holds_direction(const SceneView& scene, Mask active, Int face, Int material) {
    if (!scene.face_held) return splat(0);
    const Mask some = receives_held(scene, active & (face >= 0), material);
    return some & (gather(scene.face_held, select(some, face, splat(0))) != 0);
}

}  // namespace edgegrad::EDGEGRAD_ISA
