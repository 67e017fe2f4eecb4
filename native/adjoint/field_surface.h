// Hits of distance fields as functions of their fields.
//
// The surface moves along its normals: a point of it has the velocity m = -dphi g / |g|^2 for a change dphi
// of the field with the gradient g. The tangent triangle that stands for a hit (sdf/tangent_plane.h) moves
// with the derivative of m, so that its area normal turns and grows as that of the surface does. The code
// that moves triangles of meshes then moves hits of fields as well, in screen form and in material form.
#pragma once

#include "adjoint/blocks.h"
#include "sdf/field_block.h"

namespace edgegrad::EDGEGRAD_ISA {

// A packet's points on fields. Derivatives of the fields are multiplied by a power of two that brings
// gradients near 1: values of fields have any scale, and squares of small floats are 0.
struct FieldPoints {
    const FieldView* field[W];  // null: not on a field
    FieldJet jet[W];            // unscaled
    raw::Float scale;
    RawVec3 g;           // gradients in the world
    raw::Float h[6];     // xx, yy, zz, yz, xz, xy
    raw::Float inverse;  // 1 / |g|^2

    EG_INLINE RawVec3 by_hessian(const RawVec3& v) const {
        return {h[0] * v.x + h[5] * v.y + h[4] * v.z, h[5] * v.x + h[1] * v.y + h[3] * v.z,
                h[4] * v.x + h[3] * v.y + h[2] * v.z};
    }
};

// A power of two times which the largest component of a gradient is between 1 and 2, as far as floats reach.
inline float gradient_scale(const float (&g)[3]) {
    float most = 0.0f;
    for (float c : g) most = __builtin_fmaxf(most, __builtin_fabsf(c));
    if (!(most > 0.0f)) return 1.0f;
    const int exponent = __builtin_ilogbf(most);
    return __builtin_ldexpf(1.0f, exponent < -126 ? 126 : -exponent);
}

inline void find_field_points(const SceneView& scene, Mask lanes, Int face, const RawVec3& at,
                              FieldPoints& out) {
    out.g = raw_zero3();
    out.scale = raw::splat(1.0f);
    for (raw::Float& h : out.h) h = raw::splat(0.0f);
    for (int i = 0; i < W; ++i) {
        out.field[i] = lanes[i] ? &field_of_face(scene, face[i]) : nullptr;
        if (!lanes[i]) continue;
        const float position[3] = {at.x[i], at.y[i], at.z[i]};
        const FieldJet& jet = out.jet[i] = field_jet(*out.field[i], position);
        const float scale = out.scale[i] = gradient_scale(jet.gradient);
        const auto& g = jet.gradient;
        out.g.x[i] = scale * g[0], out.g.y[i] = scale * g[1], out.g.z[i] = scale * g[2];
        for (int k = 0; k < 6; ++k) out.h[k][i] = scale * jet.hessian[k];
    }
    out.inverse = finite_inverse(dot(out.g, out.g));
}

// Results: the corners of the tangent triangle.
struct FieldTriangle {
    static constexpr int kResults = 9;
    int32_t first;
    const FieldDerivatives* derivatives;
    FieldPoints x;
    RawVec3 edge[2];

    void backward(raw::Float* a) const {
        const RawVec3 corner = read(a, first), end[2] = {read(a, first + 3), read(a, first + 6)};
        const raw::Mask live = nonzero(corner) | nonzero(end[0]) | nonzero(end[1]);
        if (!raw::any(live)) return;
        raw::Float alpha = raw::splat(0.0f) - dot(corner + end[0] + end[1], x.g) * x.inverse;
        RawVec3 beta = raw_zero3();
        for (int k = 0; k < 2; ++k) {
            const RawVec3 bent = x.by_hessian(edge[k]);
            const raw::Float along = dot(end[k], x.g) * x.inverse;
            beta = beta - edge[k] * along;
            alpha = alpha - (dot(end[k], bent) - 2.0f * along * dot(x.g, bent)) * x.inverse;
        }
        for (int i = 0; i < W; ++i) {
            if (!live[i] || !x.field[i] || !derivatives->moves(*x.field[i])) continue;
            const float k = x.scale[i], b[3] = {k * beta.x[i], k * beta.y[i], k * beta.z[i]};
            field_backward(*x.field[i], *derivatives, x.jet[i], k * alpha[i], b);
        }
    }
    void forward(raw::Float* a) const {
        raw::Float change = raw::splat(0.0f);
        RawVec3 slope = raw_zero3();
        for (int i = 0; i < W; ++i) {
            if (!x.field[i] || !derivatives->moves(*x.field[i])) continue;
            float value, s[3];
            field_forward(*x.field[i], *derivatives, x.jet[i], value, s);
            const float k = x.scale[i];
            change[i] = k * value;
            slope.x[i] = k * s[0], slope.y[i] = k * s[1], slope.z[i] = k * s[2];
        }
        const raw::Mask live = (change != 0.0f) | nonzero(slope);
        const RawVec3 m = x.g * (raw::splat(0.0f) - change * x.inverse);
        write(a, first, live, m);
        for (int k = 0; k < 2; ++k) {
            const RawVec3 bent = x.by_hessian(edge[k]);
            const raw::Float along = 2.0f * change * dot(x.g, bent) * x.inverse - dot(slope, edge[k]);
            const RawVec3 turn = (x.g * along - bent * change) * x.inverse;
            write(a, first + 3 + 3 * k, live, m + turn);
        }
    }
};

// Lets the tangent triangles of lanes on fields move with their fields.
EG_INLINE void move_field_triangle(Mask lanes, const FieldPoints& x, Triangle& t) {
    const FieldDerivatives& derivatives = current_tape->fields();
    bool moves = false;
    for (int i = 0; i < W; ++i) moves |= x.field[i] && derivatives.moves(*x.field[i]);
    if (!moves) return;
    FieldTriangle& block = current_tape->new_block<FieldTriangle>();
    block.derivatives = &derivatives;
    block.x = x;
    const RawVec3 corner = values(t.p0), end[2] = {values(t.p1), values(t.p2)};
    for (int k = 0; k < 2; ++k) block.edge[k] = end[k] - corner;
    const int32_t first = block.first;
    const Triangle moving{results(corner, first), results(end[0], first + 3), results(end[1], first + 6)};
    t = taped(t) ? select(lanes, moving, t) : moving;
}

// The same for triangles that settle_on_fields has made.
EG_INLINE void move_settled_triangle(const SceneView& scene, Mask active, Int face, Triangle& t) {
    if (scene.field_count == 0 || !current_tape->fields().any()) return;
    const Mask lanes = on_field(scene, active, face);
    if (!any(lanes)) return;
    FieldPoints x;
    find_field_points(scene, lanes, face, values(t.p0), x);
    move_field_triangle(lanes, x, t);
}

// The normal of a field turns as its point moves over the surface: beside the motion of the surface, which
// the triangle `t` has, if it moves.
EG_INLINE void turn_field_normals(const FieldPoints& field, const Triangle& t, SurfacePoint& x) {
    const Vec3 step = x.position - t.p0;
    if (!taped(nodes(step))) return;
    // side * (H - n n^T H) / |g|, 0 without a field
    const raw::Float scale = x.side.value * raw::sqrt(field.inverse);
    const RawVec3 by[3] = {{field.h[0], field.h[5], field.h[4]},
                           {field.h[5], field.h[1], field.h[3]},
                           {field.h[4], field.h[3], field.h[2]}};
    const RawVec3 along = field.by_hessian(field.g) * field.inverse;
    const auto row = [&](const RawVec3& h, raw::Float g) { return constant3((h - along * g) * scale); };
    x.normal = x.normal + Vec3{dot(row(by[0], field.g.x), step), dot(row(by[1], field.g.y), step),
                               dot(row(by[2], field.g.z), step)};
}

}  // namespace edgegrad::EDGEGRAD_ISA
