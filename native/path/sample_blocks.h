// Adjoint blocks (derivations, section 1): the effect of a velocity of the geometry on a sample.
//
// Every geometric derivative of a sample is a sum of dot products g . velocity over a few blocks: a point at
// fixed barycentrics of a triangle (M), the point where a fixed pixel's ray meets its moving triangle (S), a
// triangle's normal (N), a point of an edge (E), the surface of a distance field (F). The estimators compute
// the vectors g once. `Forward` multiplies them by the vertices' velocities; `Backward` adds them to the
// vertices' gradients. Both modes thus use the same samples and are transposes of each other.
#pragma once

#include "scene/camera_row.h"
#include "scene/geometry.h"
#include "sdf/field_block.h"

namespace edgegrad::EDGEGRAD_ISA {

EG_INLINE Vec3 gather_velocity(const SceneView& scene, const DerivativeView& tangent, Mask moves, Int face,
                               int corner) {
    Vec3 v = zero3();
    for (int i = 0; i < W; ++i) {
        if (!moves[i]) continue;
        const int64_t vertex = scene.faces[3 * static_cast<int64_t>(face[i]) + corner] - tangent.first_vertex;
        const double* p = tangent.vertices + 3 * vertex;
        v.x[i] = static_cast<float>(p[0]);
        v.y[i] = static_cast<float>(p[1]);
        v.z[i] = static_cast<float>(p[2]);
    }
    return v;
}

// What moves with a field: the points of its surface, or its unit normals at fixed points.
enum class FieldMotion { kSurface, kNormal };

// The motion, dotted with g, is alpha dphi + beta . grad dphi (sdf/field_block.h). The surface moves by
// -dphi / |grad phi| along its normal, and the normal turns by the part of grad dphi / |grad phi| in the
// tangent plane. Calls back with the fields that have derivatives, the points' derivatives, alpha and beta.
template <typename Block>
EG_INLINE void for_each_field_point(const SceneView& scene, const FieldDerivatives& fields,
                                    FieldMotion motion, Mask lanes, Int face, Vec3 at, Vec3 g,
                                    const Block& block) {
    for (int i = 0; i < W; ++i) {
        if (!lanes[i]) continue;
        const FieldView& field = field_of_face(scene, face[i]);
        if (!fields.moves(field)) continue;
        const FieldJet x = field_jet(field, {at.x[i], at.y[i], at.z[i]});
        const auto& n = x.gradient;
        const float by[3] = {g.x[i], g.y[i], g.z[i]};
        // In double precision: values of fields have any scale, and squares of floats may fall below all
        // floats.
        const double gx = n[0], gy = n[1], gz = n[2];
        const double square = __builtin_fmax(gx * gx + gy * gy + gz * gz, 1e-300);
        const double along = (by[0] * gx + by[1] * gy + by[2] * gz) / square;
        float beta[3] = {};
        if (motion == FieldMotion::kNormal)
            for (int k = 0; k < 3; ++k)
                beta[k] = static_cast<float>((by[k] - along * n[k]) / __builtin_sqrt(square));
        block(i, field, x, motion == FieldMotion::kSurface ? -static_cast<float>(along) : 0.0f, beta);
    }
}

// Sums weight * (g . velocity), with one weight for each colour channel.
struct Forward {
    const SceneView& scene;
    const DerivativeView& tangent;
    Vec3 value = zero3();  // derivative of the samples' radiance

    EG_INLINE void corner(Mask moves, Int face, int k, Vec3 g, Vec3 color) {
        const Float d = dot(g, gather_velocity(scene, tangent, moves, face, k));
        value = value + color * select(moves, d, 0.0f);
    }
    EG_INLINE void edge_end(Mask moves, int vertex_slot, Int edge, Vec3 g, Vec3 color) {
        for (int i = 0; i < W; ++i) {
            if (!moves[i]) continue;
            const int64_t vertex =
                static_cast<int64_t>(scene.edge_vertices[2 * static_cast<int64_t>(edge[i]) + vertex_slot]);
            const double* p = tangent.vertices + 3 * (vertex - tangent.first_vertex);
            const float d = g.x[i] * static_cast<float>(p[0]) + g.y[i] * static_cast<float>(p[1]) +
                            g.z[i] * static_cast<float>(p[2]);
            value.x[i] += color.x[i] * d;
            value.y[i] += color.y[i] * d;
            value.z[i] += color.z[i] * d;
        }
    }
    // A velocity that is linear in the camera's floats, with the coefficients `row`.
    EG_INLINE void camera(Mask m, const Float row[kCameraFloats], Vec3 color) {
        Float d = splat(0.0f);
        for (int k = 0; k < kCameraFloats; ++k) d = d + row[k] * static_cast<float>(tangent.camera[k]);
        value = value + color * select(m, d, 0.0f);
    }
    // The same for the floats of a row of the light table, and for the environment's rotation.
    EG_INLINE void light(Mask m, Int light, const Float (&row)[kLightParams], Vec3 color) {
        Float d = splat(0.0f);
        for (int i = 0; i < W; ++i) {
            if (!m[i]) continue;
            const double* p = tangent.light_params + kLightParams * static_cast<int64_t>(light[i]);
            for (int k = 0; k < kLightParams; ++k) d[i] += row[k][i] * static_cast<float>(p[k]);
        }
        value = value + color * d;
    }
    EG_INLINE void rotation(Mask m, const Float (&row)[9], Vec3 color) {
        Float d = splat(0.0f);
        for (int k = 0; k < 9; ++k) d = d + row[k] * static_cast<float>(tangent.environment_rotation[k]);
        value = value + color * select(m, d, 0.0f);
    }
    // A point of an instance, with the position `local` in the mesh's object space.
    EG_INLINE void placed(Mask m, Int instance, Vec3 local, Vec3 g, Vec3 color) {
        Float d = splat(0.0f);
        for (int i = 0; i < W; ++i) {
            if (!m[i]) continue;
            const double* p = tangent.instance_to_world + 12 * static_cast<int64_t>(instance[i]);
            const float q[4] = {local.x[i], local.y[i], local.z[i], 1.0f}, out[3] = {g.x[i], g.y[i], g.z[i]};
            for (int k = 0; k < 12; ++k) d[i] += out[k / 4] * q[k % 4] * static_cast<float>(p[k]);
        }
        value = value + color * d;
    }
    EG_INLINE void field(Mask m, Int face, Vec3 at, Vec3 g, Vec3 color,
                         FieldMotion motion = FieldMotion::kSurface) {
        Float d = splat(0.0f);
        for_each_field_point(
            scene, tangent.fields, motion, m, face, at, g,
            [&](int i, const FieldView& field, const FieldJet& x, float alpha, const float (&beta)[3]) {
                float change, slope[3];
                field_forward(field, tangent.fields, x, change, slope);
                d[i] = alpha * change + beta[0] * slope[0] + beta[1] * slope[1] + beta[2] * slope[2];
            });
        value = value + color * d;
    }
};

struct Backward {
    const SceneView& scene;
    const DerivativeView& gradient;
    Vec3 adjoint;  // adjoint of the samples' radiance

    EG_INLINE void add(int64_t vertex, float s, Vec3 g, int i) {
        double* p = gradient.vertices + 3 * (vertex - gradient.first_vertex);
        p[0] += static_cast<double>(s * g.x[i]);
        p[1] += static_cast<double>(s * g.y[i]);
        p[2] += static_cast<double>(s * g.z[i]);
    }
    EG_INLINE void corner(Mask moves, Int face, int k, Vec3 g, Vec3 color) {
        const Float a = dot(adjoint, color);
        for (int i = 0; i < W; ++i)
            if (moves[i]) add(scene.faces[3 * static_cast<int64_t>(face[i]) + k], a[i], g, i);
    }
    EG_INLINE void edge_end(Mask moves, int vertex_slot, Int edge, Vec3 g, Vec3 color) {
        const Float a = dot(adjoint, color);
        for (int i = 0; i < W; ++i)
            if (moves[i])
                add(scene.edge_vertices[2 * static_cast<int64_t>(edge[i]) + vertex_slot], a[i], g, i);
    }
    EG_INLINE void camera(Mask m, const Float row[kCameraFloats], Vec3 color) {
        const Float a = dot(adjoint, color);
        for (int k = 0; k < kCameraFloats; ++k) {
            const Float part = select(m, a * row[k], 0.0f);  // other lanes may hold infinities
            for (int i = 0; i < W; ++i) gradient.camera[k] += static_cast<double>(part[i]);
        }
    }
    EG_INLINE void light(Mask m, Int light, const Float (&row)[kLightParams], Vec3 color) {
        const Float a = dot(adjoint, color);
        for (int i = 0; i < W; ++i) {
            if (!m[i]) continue;
            double* p = gradient.light_params + kLightParams * static_cast<int64_t>(light[i]);
            for (int k = 0; k < kLightParams; ++k) p[k] += static_cast<double>(a[i] * row[k][i]);
        }
    }
    EG_INLINE void rotation(Mask m, const Float (&row)[9], Vec3 color) {
        const Float a = dot(adjoint, color);
        for (int k = 0; k < 9; ++k) {
            const Float part = select(m, a * row[k], 0.0f);
            for (int i = 0; i < W; ++i) gradient.environment_rotation[k] += static_cast<double>(part[i]);
        }
    }
    EG_INLINE void placed(Mask m, Int instance, Vec3 local, Vec3 g, Vec3 color) {
        const Float a = dot(adjoint, color);
        for (int i = 0; i < W; ++i) {
            if (!m[i]) continue;
            double* p = gradient.instance_to_world + 12 * static_cast<int64_t>(instance[i]);
            const float q[4] = {local.x[i], local.y[i], local.z[i], 1.0f}, out[3] = {g.x[i], g.y[i], g.z[i]};
            for (int k = 0; k < 12; ++k) p[k] += static_cast<double>(a[i] * out[k / 4] * q[k % 4]);
        }
    }
    EG_INLINE void field(Mask m, Int face, Vec3 at, Vec3 g, Vec3 color,
                         FieldMotion motion = FieldMotion::kSurface) {
        const Float a = dot(adjoint, color);
        for_each_field_point(
            scene, gradient.fields, motion, m, face, at, g,
            [&](int i, const FieldView& field, const FieldJet& x, float alpha, const float (&beta)[3]) {
                field_backward(field, gradient.fields, x, a[i] * alpha,
                               {a[i] * beta[0], a[i] * beta[1], a[i] * beta[2]});
            });
    }
};

}  // namespace edgegrad::EDGEGRAD_ISA
