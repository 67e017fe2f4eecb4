// The outline of an emissive mesh as seen from surfaces, for light parametrised by a fixed direction
// (shading/lights/fixed_direction_light.h). Along a fixed direction, radiance is discontinuous at the edges
// where an emissive face begins. With r = |x - e| and beta the throughput of a path of the picture to its
// k-th vertex x (derivations, K)
//   dI = int ds beta sum over edges int du  f |n_s . w|/r^2 (L- - L+) (t x w) . (de - dx).
// L+ and L- are the emission of the edge's nearest face on the side to which +(t x w) and -(t x w) point, or
// 0 without a face there. What lies behind the edge belongs to the shadow term, in which the same edge is an
// occluder.
//
// Sampled like boundary/terms/camera_sampled.h, for all lobes: edges are chosen near a direction that the
// BSDF of x has sampled.
#pragma once

#include "boundary/samples/direct_samples.h"
#include "boundary/terms/camera_sampled.h"
#include "tasks/boundary_task.h"
#include "tasks/image_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// Candidates per sample. More candidates reduce the variance; no candidate costs a path.
constexpr int kOutlineCandidates = 16;

// L- - L+ towards a point x. `towards` leads from x to the edge, and `across` is t x w.
EG_INLINE Vec3 emission_jump(const SceneView& scene, const SegmentSample& p, Mask active, Vec3 across,
                             Vec3 towards) {
    const Float tt = 1.0f / max(dot(p.t, p.t), 1e-37f);
    const Vec3 deep =
        towards - p.t * (dot(towards, p.t) * tt);  // perpendicular to the edge, in the plane of edge and ray
    Vec3 jump = zero3();
    for (int i = 0; i < W; ++i) {
        if (!active[i]) continue;
        // On each side the face whose depth increases least with the distance from the edge occludes the
        // others.
        float nearest[2] = {__builtin_inff(), __builtin_inff()};
        int64_t face[2] = {-1, -1};
        bool back[2] = {false, false};
        for (uint32_t k = scene.edge_face_first[p.edge[i]]; k < scene.edge_face_first[p.edge[i] + 1]; ++k) {
            float c[3];
            across_edge(scene, p, i, k, c);
            const float h = across.x[i] * c[0] + across.y[i] * c[1] + across.z[i] * c[2];
            if (h == 0.0f) continue;
            const float depth = deep.x[i] * c[0] + deep.y[i] * c[1] + deep.z[i] * c[2];
            const int side = h > 0.0f;
            const float slope = depth / __builtin_fabsf(h);
            if (!(slope < nearest[side])) continue;
            nearest[side] = slope;
            face[side] = scene.edge_faces[k];
            // The winding order of the face's corners decides which side faces x.
            const int32_t* f = scene.faces + 3 * face[side];
            const auto v = [&](int corner, float (&out)[3]) {
                for (int j = 0; j < 3; ++j) out[j] = scene.vertices[3 * static_cast<int64_t>(f[corner]) + j];
            };
            float v0[3], v1[3], v2[3];
            v(0, v0), v(1, v1), v(2, v2);
            const float a[3] = {v1[0] - v0[0], v1[1] - v0[1], v1[2] - v0[2]};
            const float b[3] = {v2[0] - v0[0], v2[1] - v0[1], v2[2] - v0[2]};
            back[side] = towards.x[i] * (a[1] * b[2] - a[2] * b[1]) +
                             towards.y[i] * (a[2] * b[0] - a[0] * b[2]) +
                             towards.z[i] * (a[0] * b[1] - a[1] * b[0]) >
                         0.0f;
        }
        // Subtract the emission of the two sides
        for (int side = 0; side < 2; ++side) {
            if (face[side] < 0 || !scene.face_fixed_direction[face[side]]) continue;
            const int32_t material = scene.face_material[face[side]];
            if (back[side] && !scene.emission_two_sided[material]) continue;
            const float* emission = scene.emission + 3 * static_cast<int64_t>(material);
            const float sign = side ? -1.0f : 1.0f;
            jump.x[i] += sign * emission[0], jump.y[i] += sign * emission[1], jump.z[i] += sign * emission[2];
        }
    }
    return jump;
}

// The task's samples as paths of the picture.
EG_INLINE ImageTask outline_paths(const BoundaryTask& task) {
    return sample_paths(task, 1, hash(task.seed ^ 0x2c1b3c6du));
}

// A sample of the term (boundary/samples/direct_samples.h).
EG_OUTLINE BoundarySegment sample_emitter_outline(const SceneView& scene, const BoundaryTask& task,
                                                  int64_t at, SegmentCursor& cursor,
                                                  const DerivativeView& requested, const float* adjoint) {
    BoundarySegment s;
    // Follow a path of the picture to x
    PicturePath begun = start_in_picture(scene, task, at, cursor, task.max_depth - 2, s);
    SegmentSample& p = begun.segment;
    PathPacket& path = begun.path;
    s.distance = splat(__builtin_inff());
    const ImageTask walks = outline_paths(task);
    WalkParts parts;
    walk_camera_paths(scene, walks, path, begun.hit, begun.length + 1, {}, nullptr, &parts);
    leave_followed(scene, s.screen_form, parts.followed, path);
    // Behind perfect mirrors and smooth glass light is parametrised by material points.
    path.active &= s.screen_form | (path.pdf > 0.0f);
    if (!any(path.active)) return s;
    const ScatteringPoint x = scattering_point(scene, walks, path, path.active, begun.hit);
    s.active = receives_held(scene, x.x.active, x.x.material);
    s.view = place_in_picture(scene, s.active, select(s.screen_form, x.x.position, begun.first), p.random);
    s.active &= s.view.active;
    if (!task.score && any(s.active)) s.active &= has_adjoint(scene, s.active, s.view.sx, s.view.sy, adjoint);
    if (!any(s.active)) return s;
    // Sample an edge in the lobes of x
    const CameraSampledSurface surface(scene, x, s.active, followed_in_picture(scene, s));
    const PathIndex walk = path_index(walks, path.path);
    const Vec3 value = sample_edge_in_lobes(scene, task, x, surface, splat(kScatteredRays), walk, path.vertex,
                                            kOutlineCandidates, p, s);
    if (!any(s.active)) return s;

    s.sweep = cross(s.towards, p.t);  // t x w
    const Vec3 jump = emission_jump(scene, p, s.active, s.sweep, s.towards);
    s.active &= (largest_component(jump) > 0.0f) & ~on_edge_face(scene, p, x.x);
    // If x is closer to the edge than rounding, the jump is part of the primary term (derivations, F3c).
    s.active &= s.reach > 1e-5f * largest_component(s.point);
    divide_segment(s);
    s.active &= segment_moves(scene, requested, s);
    if (!any(s.active)) return s;

    // Evaluate the transmittance and the jump
    const Vec3 start = leave_surface(x.x, s.towards) + terminator_lift(scene, x.x, x.point.normal, s.towards);
    const Vec3 seen =
        transmittance(scene, s.active, start, s.point - start, splat(0.99999f),
                      {splat(1 << kShadowRay), kShadowRay, task.limits.transparent, {s.edge, s.instance}});
    s.color = path.throughput * value * seen * jump * (x.shader.scale * begun.weight);
    divide_slide(s);
    s.active &= ~(largest_component(s.color) == 0.0f);
    return s;
}

}  // namespace edgegrad::EDGEGRAD_ISA
