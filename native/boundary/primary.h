// Primary boundary term: what changes where an edge sweeps over the picture.
//
// With e(u) a point of an edge of direction t = b - a (not normalised), o the camera, z the depth of
// e and f the focal length in pixels (derivations, formula P and section A):
//   dI = int du (L- - L+) (f^2/z^3) N . de,    N = (e - o) x t,
// L+ and L- the radiance seen just beside the edge on the side to which +N and -N points. Per side:
// the nearest of the edge's faces on it, or what lies behind the edge. Both sides are evaluated by
// construction: a near face at e itself, the far side by one ray that ignores the edge's faces; no
// point is nudged by an epsilon. Both use the same random numbers.
#pragma once

#include "boundary/pieces.h"
#include "path/blocks.h"

namespace edgegrad::EDGEGRAD_ISA {

struct EdgeSample {
    Mask active;
    Int edge;
    Float u;                                // position along the edge
    Float weight;                           // (f^2/z^3) / density
    Vec3 point, relative, tangent, normal;  // e, e - o, t, N
    Vec3 direction;                         // towards e, of unit depth
    Float depth;
    Int pixel;
    PathIndex random;
};

// Faces of the edge that are seen just beside it; -1: none on that side.
struct Sides {
    Int plus, minus;
};

// Samples [task.first + at, …) of the pieces, seen from the camera.
EG_INLINE EdgeSample sample_edge(const SceneView& scene, const BoundaryTask& task, int64_t at,
                                 int64_t& piece) {
    const PieceSample place = sample_piece(scene, task, at, piece);
    EdgeSample s;
    s.active = place.active;
    s.edge = place.edge;
    s.random = place.random;
    const CameraView& c = scene.camera;
    const Vec3 o = splat3(c.position), back = splat3(c.back), a = place.a, t = place.t;
    // Uniform along the piece on the screen: with depths z0, z1 at its ends, the fraction tau of the
    // screen length lies at the fraction tau z0/(z1 + tau (z0 - z1)) of the piece in space.
    const Float z_a = -dot(back, a - o), z_t = -dot(back, t), length = place.u1 - place.u0;
    const Float z0 = z_a + place.u0 * z_t, z1 = z_a + place.u1 * z_t;
    const Float w = z1 + place.tau * (z0 - z1);
    s.u = place.u0 + length * (place.tau * z0 / w);
    const Float du = length * (z0 * z1 / (w * w));  // du / dtau
    s.point = a + t * s.u;
    s.tangent = t;
    s.relative = s.point - o;
    s.depth = -dot(back, s.relative);
    s.normal = cross(a - o, t);  // the same for all points of the edge
    s.direction = s.relative * (1.0f / s.depth);
    s.weight = du * (c.focal * c.focal) / (s.depth * s.depth * s.depth * place.density);
    s.pixel = pixel_of(c, s.direction, s.active);
    s.active &= s.depth > 0.0f;
    return s;
}

// Per side the face that is nearest to the camera just beside the edge: the one of smallest depth
// slope -(n . g)/(n . (e - o)), g = +-N. A face seen exactly edge-on lies on no side.
EG_INLINE Sides visible_faces(const SceneView& scene, const EdgeSample& s) {
    Sides sides{splat(-1), splat(-1)};
    for (int i = 0; i < W; ++i) {
        if (!s.active[i]) continue;
        const int32_t edge = s.edge[i];
        const float n[3] = {s.normal.x[i], s.normal.y[i], s.normal.z[i]};
        const float p[3] = {s.relative.x[i], s.relative.y[i], s.relative.z[i]};
        const float* a = scene.vertices + 3 * static_cast<int64_t>(scene.edge_vertices[2 * edge]);
        float best[2] = {__builtin_inff(), __builtin_inff()};
        for (uint32_t k = scene.edge_face_first[edge]; k < scene.edge_face_first[edge + 1]; ++k) {
            const int32_t face = static_cast<int32_t>(scene.edge_faces[k]);
            const int32_t* f = scene.faces + 3 * static_cast<int64_t>(face);
            const float* p0 = scene.vertices + 3 * static_cast<int64_t>(f[0]);
            const float* p1 = scene.vertices + 3 * static_cast<int64_t>(f[1]);
            const float* p2 = scene.vertices + 3 * static_cast<int64_t>(f[2]);
            const float d1[3] = {p1[0] - p0[0], p1[1] - p0[1], p1[2] - p0[2]};
            const float d2[3] = {p2[0] - p0[0], p2[1] - p0[1], p2[2] - p0[2]};
            const float m[3] = {d1[1] * d2[2] - d1[2] * d2[1], d1[2] * d2[0] - d1[0] * d2[2],
                                d1[0] * d2[1] - d1[1] * d2[0]};
            const float* c = scene.vertices + 3 * static_cast<int64_t>(scene.edge_opposite[k]);
            const float on = n[0] * (c[0] - a[0]) + n[1] * (c[1] - a[1]) + n[2] * (c[2] - a[2]);
            const float mp = m[0] * p[0] + m[1] * p[1] + m[2] * p[2];
            if (on == 0.0f || mp == 0.0f) continue;
            const int side = on > 0.0f ? 0 : 1;
            const float mn = m[0] * n[0] + m[1] * n[1] + m[2] * n[2];
            const float slope = (side ? mn : -mn) / mp;
            if (slope < best[side]) {
                best[side] = slope;
                (side ? sides.minus : sides.plus)[i] = face;
            }
        }
    }
    return sides;
}

// Barycentrics of an edge's point on a face of that edge.
EG_INLINE void edge_barycentrics(const SceneView& scene, const EdgeSample& s, Int face, Float& b1,
                                 Float& b2) {
    const Triangle t = gather_triangle(scene, select(face >= 0, face, splat(0)));
    const Vec3 e1 = t.p1 - t.p0, e2 = t.p2 - t.p0, d = s.point - t.p0;
    const Float d11 = dot(e1, e1), d12 = dot(e1, e2), d22 = dot(e2, e2), r1 = dot(d, e1), r2 = dot(d, e2);
    const Float det = d11 * d22 - d12 * d12;
    const Float inv = 1.0f / select(det != 0.0f, det, 1.0f);
    b1 = (d22 * r1 - d12 * r2) * inv;
    b2 = (d11 * r2 - d12 * r1) * inv;
}

// What the camera sees behind the edge, and the face in which the edge lies there (contact), or -1.
struct Behind {
    Closest hit;
    Int touched;
};

// One ray from the camera through e that ignores the edge's faces; lanes where something is in front
// of e become inactive. It starts at the camera, so that a surface touching the edge isn't lost.
EG_INLINE Behind look_behind(const SceneView& scene, EdgeSample& s) {
    const CameraView& c = scene.camera;
    Behind behind;
    behind.hit = intersect(scene, s.active, splat3(c.position), s.direction, splat(c.clip_start),
                           splat(c.clip_end), {s.edge, splat(-1)}, embree::kIncoherent);
    constexpr float kBefore = 1e-5f;  // in depths
    s.active &= ~(behind.hit.hit & (behind.hit.distance < s.depth * (1.0f - kBefore)));
    // Contact: the hit is at e, and the edge lies in its plane.
    constexpr float kContact = 1e-5f, kAlong = 1e-3f, kHere = 1e-3f;
    const Triangle t = gather_triangle(scene, behind.hit.face);
    const Vec3 m = area_normal(t);
    const Float length = max(sqrt(dot(m, m)), 1e-30f), scale = max(largest_component(s.point), s.depth);
    const Mask here = behind.hit.hit & (behind.hit.distance < s.depth * (1.0f + kHere)) &
                      (abs(dot(m, s.point - t.p0)) < length * scale * kContact) &
                      (abs(dot(m, s.tangent)) < length * sqrt(dot(s.tangent, s.tangent)) * kAlong);
    behind.touched = select(here, behind.hit.face, splat(-1));
    return behind;
}

// Radiance beside the edge on the side to which `outwards` (+-N) points: of the near face where there
// is one, else of what lies behind the edge.
EG_INLINE Vec3 side_radiance(const SceneView& scene, const EdgeSample& s, Int near_face, Vec3 outwards,
                             const Behind& behind, int max_depth, const LightRandom& random) {
    const Mask near = s.active & (near_face >= 0);
    const Mask far = s.active & ~near & behind.hit.hit;
    const Mask touching = s.active & (behind.touched >= 0);
    Float b1, b2;
    edge_barycentrics(scene, s, near_face, b1, b2);
    SurfacePoint x =
        surface_point(scene, near | far, select(near, near_face, behind.hit.face),
                      select(near, b1, behind.hit.b1), select(near, b2, behind.hit.b2), s.direction);
    // Near faces and a touched one are shaded at the edge itself.
    const Mask at_edge = near | (far & touching);
    x.position = select(at_edge, s.point, x.position);
    x.ignored.edge = select(at_edge, s.edge, splat(-1));
    x.ignored.face = select(touching, behind.touched, splat(-1));
    // In its own surface, away from the edge: across t, on the side looked at.
    const Vec3 across = cross(s.tangent, x.normal);
    x.along = select(dot(across, outwards) < 0.0f, -across, across);
    Vec3 radiance = outgoing_radiance(scene, x, max_depth, random);
    return select(s.active & ~near & ~behind.hit.hit, splat3(scene.environment), radiance);
}

// The jump (L- - L+) of visible samples; lanes that are hidden or see no jump are made inactive.
EG_INLINE Vec3 edge_jump(const SceneView& scene, EdgeSample& s, int max_depth) {
    const Sides sides = visible_faces(scene, s);
    // A point on no side of any face (the edge is seen end-on) has no jump.
    s.active &= (sides.plus >= 0) | (sides.minus >= 0);
    if (!any(s.active)) return zero3();
    const Behind behind = look_behind(scene, s);
    if (!any(s.active)) return zero3();
    LightRandom random{};
    if (max_depth >= 2) random = light_random(scene, s.random.stream, s.random.sample);
    const Vec3 plus = side_radiance(scene, s, sides.plus, s.normal, behind, max_depth, random);
    const Vec3 minus = side_radiance(scene, s, sides.minus, -s.normal, behind, max_depth, random);
    return minus - plus;
}

template <typename Mode>
EG_INLINE void edge_blocks(Mode& mode, const EdgeSample& s, Vec3 jump) {
    const Vec3 g = s.normal * s.weight;
    mode.edge_end(s.active, 0, s.edge, g * (1.0f - s.u), jump);
    mode.edge_end(s.active, 1, s.edge, g * s.u, jump);
}

static void primary_forward_kernel(const SceneView& scene, const BoundaryTask& task,
                                   const DerivativeView& tangent, Splats& splats) {
    int64_t piece = first_piece(task);
    for (int64_t at = 0; at < task.count; at += W) {
        EdgeSample s = sample_edge(scene, task, at, piece);
        Forward mode{scene, tangent};
        const Vec3 jump = edge_jump(scene, s, task.max_depth);
        edge_blocks(mode, s, jump);
        write_splats(task, splats, at, s.active, s.pixel, mode.value);
    }
}

static void primary_backward_kernel(const SceneView& scene, const BoundaryTask& task, const float* adjoint,
                                    DerivativeView& gradient) {
    int64_t piece = first_piece(task);
    for (int64_t at = 0; at < task.count; at += W) {
        EdgeSample s = sample_edge(scene, task, at, piece);
        const Vec3 a = gather3(adjoint, s.pixel);
        s.active &= largest_component(a) > 0.0f;  // where nothing is asked, nothing is traced
        if (!any(s.active)) continue;
        const Vec3 jump = edge_jump(scene, s, task.max_depth);
        Backward mode{scene, gradient, a};
        edge_blocks(mode, s, jump);
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
