// Adjoint blocks E, M and F (derivations, section 1): the velocity of material points of edges, faces and
// fields, dotted with g and multiplied by `color`, for the requested parameters.
//
// A point of an instanced mesh is at M q, with q in the mesh's space. It moves with the transform M and with
// the mesh's vertices, which receive the adjoint M^T g.
#pragma once

#include "boundary/samples/segment_sampling.h"

namespace edgegrad::EDGEGRAD_ISA {

// Applies the transpose of the linear part of an instance's transform.
EG_INLINE Vec3 into_instance(const SceneView& scene, Int instance, Vec3 g) {
    if (!any(instance >= 0)) return g;
    for (int i = 0; i < W; ++i) {
        if (instance[i] < 0) continue;
        const float* m = scene.instance_to_world + 12 * static_cast<int64_t>(instance[i]);
        const float x = g.x[i], y = g.y[i], z = g.z[i];
        g.x[i] = m[0] * x + m[4] * y + m[8] * z;
        g.y[i] = m[1] * x + m[5] * y + m[9] * z;
        g.z[i] = m[2] * x + m[6] * y + m[10] * z;
    }
    return g;
}

// The first face of an edge.
EG_INLINE Int edge_face(const SceneView& scene, Int edge) {
    return gather(scene.edge_faces, gather(scene.edge_face_first, edge));
}

// Whether some of the kinds of rays in a mask meet the edge's mesh.
EG_INLINE Mask is_met(const SceneView& scene, Int edge, Int rays) {
    return (gather(scene.mesh_mask, mesh_of(scene, edge_face(scene, edge))) & rays) != 0;
}

// Whether vertices of the edge's mesh are requested.
EG_INLINE Mask edge_moving(const SceneView& scene, Int edge) {
    return gather(scene.face_moving, edge_face(scene, edge)) == kVerticesMove;
}

// Whether a point of an edge, of a curve on a field, or of a face may move.
EG_INLINE Mask edge_point_moves(const SceneView& scene, const DerivativeView& motion, Mask active, Int edge,
                                Int instance) {
    Mask moves = active & (gather(scene.face_moving, edge_face(scene, edge)) != 0);
    if (motion.instances_requested) moves |= active & (instance >= 0);
    return moves;
}
EG_INLINE Mask face_point_moves(const SceneView& scene, const DerivativeView& motion, Mask active, Int face,
                                Int instance) {
    Mask moves = active & (gather(scene.face_moving, select(active, face, splat(0))) != 0);
    if (motion.instances_requested) moves |= active & (instance >= 0);
    return moves;
}

// The point at u on the edge (block E).
template <typename Mode>
EG_INLINE void edge_point_blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                                 Mask active, Int edge, Int instance, Float u, Vec3 g, Vec3 color) {
    const Mask placed = active & (instance >= 0);
    if (motion.instances_requested && any(placed)) {
        Vec3 local = zero3();
        for (int i = 0; i < W; ++i) {
            if (!placed[i]) continue;
            float a[3], b[3];
            edge_end(scene, edge[i], -1, 0, a);
            edge_end(scene, edge[i], -1, 1, b);
            local.x[i] = a[0] + u[i] * (b[0] - a[0]);
            local.y[i] = a[1] + u[i] * (b[1] - a[1]);
            local.z[i] = a[2] + u[i] * (b[2] - a[2]);
        }
        mode.placed(placed, instance, local, g, color);
    }
    const Mask moves = active & edge_moving(scene, edge);
    if (!any(moves)) return;
    const Vec3 local = into_instance(scene, select(moves, instance, splat(-1)), g);
    mode.edge_end(moves, 0, edge, local * (1.0f - u), color);
    mode.edge_end(moves, 1, edge, local * u, color);
}

// The point at barycentrics (b1, b2) of the face (block M).
template <typename Mode>
EG_INLINE void face_point_blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                                 Mask active, Int face, Int instance, Float b1, Float b2, Vec3 g,
                                 Vec3 color) {
    const Int known = select(active, face, splat(0));
    const Mask placed = active & (instance >= 0);
    if (motion.instances_requested && any(placed))
        mode.placed(placed, instance, interpolate(gather_triangle(scene, known), b1, b2), g, color);
    const Mask moves = active & (gather(scene.face_moving, known) == kVerticesMove);
    if (!any(moves)) return;
    const Vec3 local = into_instance(scene, select(moves, instance, splat(-1)), g);
    mode.corner(moves, known, 0, local * (1.0f - b1 - b2), color);
    mode.corner(moves, known, 1, local * b1, color);
    mode.corner(moves, known, 2, local * b2, color);
}

// The same for a point `at` of a face or of a distance field, which moves along its normal (block F).
template <typename Mode>
EG_INLINE void surface_point_blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                                    Mask active, Int face, Int instance, Float b1, Float b2, Vec3 at, Vec3 g,
                                    Vec3 color) {
    face_point_blocks(mode, scene, motion, active, face, instance, b1, b2, g, color);
    if (motion.fields.any()) mode.field(on_field(scene, active, face), face, at, g, color);
}

// The rotation of a face: g . (m(x + w) - m(x)), where x is the point at (b1, b2), w a direction in the
// face's plane, and m the velocity of the face's points, extended affinely over its plane. The difference is
// taken over a step of about the face's size. A step of unit length would be lost to rounding in the
// barycentrics of a large face.
template <typename Mode>
EG_INLINE void face_turn_blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion, Mask active,
                                Int face, Int instance, Float b1, Float b2, Vec3 w, Vec3 g, Vec3 color) {
    const Triangle t = placed_triangle(scene, active, face, instance).triangle;
    const Vec3 m = area_normal(t), e1 = t.p1 - t.p0, e2 = t.p2 - t.p0;
    const Float m2 = max(dot(m, m), 1e-37f), size = sqrt(sqrt(m2));
    const Vec3 step = w * (size / m2), part = g * (1.0f / size);
    face_point_blocks(mode, scene, motion, active, face, instance, b1 + dot(m, cross(step, e2)),
                      b2 + dot(m, cross(e1, step)), part, color);
    face_point_blocks(mode, scene, motion, active, face, instance, b1, b2, -part, color);
}

}  // namespace edgegrad::EDGEGRAD_ISA
