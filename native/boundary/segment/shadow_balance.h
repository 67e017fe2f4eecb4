// Balances two estimators of the shadows of the environment and of emissive meshes on the surfaces that the
// camera sees: samples that start at edges (boundary/terms/shadow.h), and samples that start at the camera
// (boundary/terms/camera_sampled_shadow.h).
//
// Samples from edges find small lights and small bright parts of the environment, but miss narrow lobes, and
// surfaces that are a small part of what the edges shade. Samples from the camera know the surface x and its
// lobes, but not the light. A path of either kind gets the weight
//   a_k / (a_edges + a_camera)                                  (Veach 1997, section 9.2.2),
// where a_k is about the expected number of its samples by length of the edge and solid angle of the light.
// Any a_k would do, as long as both estimators evaluate the same ones: with n_k samples and m the sum of the
// weights of all edges, which is about their length times the angle of their wedges
// (boundary/curves/candidates.h),
//   a_edges  = n_edges/m (1/4),                  where directions are sampled in the wedges, or
//            = n_edges/m (1/8 + p(w)/2),         with half of them by the environment's image, of density p,
//            = n_edges/m p(w),                   for emitter samples of density p,
//   a_camera = n_camera kappa |n . D|/|n . w| r^2  f |n_s . w| (sin/r)/2,
// where r = |x - e|, sin is that of the angle between edge and light, and n_camera is by the picture's area.
#pragma once

#include "path/camera_projection.h"
#include "scene/geometry.h"
#include "scene/view.h"
#include "shading/lights/environment_samples.h"
#include "shading/lights/lights.h"
#include "tasks/boundary_kind.h"

namespace edgegrad::EDGEGRAD_ISA {

// The density with which samples from an edge choose the direction w to the environment, as above.
EG_INLINE Float environment_density(const SceneView& scene, Vec3 w) {
    return scene.environment_image.sampled ? 0.125f + 0.5f * environment_pdf(scene, w) : splat(0.25f);
}

// The same of the direction to an emissive face, at the distance r from the edge's point e.
EG_INLINE Float emitter_density(const SceneView& scene, Mask active, Vec3 e, Int face, Vec3 w, Float r) {
    return light_pdf(scene, active, {e, w, splat(-1)}, face, w, r);
}

// The weight of samples from edges; those from the camera have the rest. `w` is the unit direction to the
// light, of the `density` above, `along` the edge, and `scattered` the largest component of
// f |n_s . w|/|n . w| at x, `reach` away. `mass` is m. Both a_k are divided by the picture's samples per
// pixel, of which each has `from_camera` samples from the camera.
EG_INLINE Float share_of_edges(const SceneView& scene, const SurfacePoint& x, const Projection& view, Vec3 w,
                               Float density, Vec3 along, Float reach, Float scattered, float mass,
                               float from_camera) {
    static_assert(kBoundaryTable[kEnvironmentShadow].share == kBoundaryTable[kShadowBoundary].share);
    constexpr auto kEdges = static_cast<float>(kBoundaryTable[kEnvironmentShadow].share);
    const float pixels = static_cast<float>(scene.camera.width) * static_cast<float>(scene.camera.height);
    const Vec3 across = cross(along, w);
    const Float sine = sqrt(dot(across, across) / max(dot(along, along), 1e-37f));
    const Float seen = view.area * abs(dot(x.normal, view.across_of));
    const Float edges = density * (kEdges * pixels / mass);
    return edges / (edges + 0.5f * from_camera * seen * reach * sine * scattered);
}

}  // namespace edgegrad::EDGEGRAD_ISA
