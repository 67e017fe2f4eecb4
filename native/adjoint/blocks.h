// Steps of the shading code that are recorded as one block (adjoint/tape.h) with hand-written derivatives:
// the adjoint blocks of the derivations, section 1. A block keeps a few vectors instead of the many edges
// that generic operations would record. Tests compare both (tests/shading/test_adjoint_blocks.py).
//
// As for the tape's edges, a lane whose adjoint is zero contributes nothing, even if the block's numbers are
// infinite or NaN.
#pragma once

#include "adjoint/number.h"
#include "sampling/hemisphere.h"
#include "scene/geometry.h"

namespace edgegrad::EDGEGRAD_ISA {

// ---- Vectors of raw packets, and their nodes on the tape ----

struct RawVec3 {
    raw::Float x, y, z;
};
EG_INLINE RawVec3 operator+(const RawVec3& a, const RawVec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
EG_INLINE RawVec3 operator-(const RawVec3& a, const RawVec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
EG_INLINE RawVec3 operator*(const RawVec3& a, raw::Float s) { return {a.x * s, a.y * s, a.z * s}; }
EG_INLINE RawVec3 operator*(const RawVec3& a, const RawVec3& b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
EG_INLINE raw::Float dot(const RawVec3& a, const RawVec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
EG_INLINE RawVec3 cross(const RawVec3& a, const RawVec3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
EG_INLINE RawVec3 select(raw::Mask m, const RawVec3& a, const RawVec3& b) {
    return {raw::select(m, a.x, b.x), raw::select(m, a.y, b.y), raw::select(m, a.z, b.z)};
}
// The component of a that is orthogonal to the unit vector n.
EG_INLINE RawVec3 across(const RawVec3& a, const RawVec3& n) { return a - n * dot(a, n); }
EG_INLINE RawVec3 raw_zero3() { return {raw::splat(0.0f), raw::splat(0.0f), raw::splat(0.0f)}; }
EG_INLINE raw::Mask nonzero(const RawVec3& a) { return (a.x != 0.0f) | (a.y != 0.0f) | (a.z != 0.0f); }

EG_INLINE RawVec3 values(const Vec3& a) { return {a.x.value, a.y.value, a.z.value}; }
EG_INLINE Vec3 constant3(const RawVec3& a) { return {constant(a.x), constant(a.y), constant(a.z)}; }

struct Nodes3 {
    int32_t x, y, z;
};
EG_INLINE Nodes3 nodes(const Vec3& a) { return {a.x.node, a.y.node, a.z.node}; }
EG_INLINE bool taped(const Nodes3& n) { return (n.x & n.y & n.z) >= 0; }
// The results of a block, at the nodes from `first` on.
EG_INLINE Vec3 results(const RawVec3& a, int32_t first) {
    return {{a.x, first}, {a.y, first + 1}, {a.z, first + 2}};
}
EG_INLINE RawVec3 read(const raw::Float* d, int32_t first) { return {d[first], d[first + 1], d[first + 2]}; }
EG_INLINE RawVec3 read(const raw::Float* d, const Nodes3& n) {
    const auto at = [d](int32_t node) { return node >= 0 ? d[node] : raw::splat(0.0f); };
    return {at(n.x), at(n.y), at(n.z)};
}
// Adds g to the adjoints of the lanes of a mask.
EG_INLINE void add(raw::Float* d, const Nodes3& n, raw::Mask live, const RawVec3& g) {
    const auto to = [&](int32_t node, raw::Float a) {
        if (node >= 0) d[node] = d[node] + raw::select(live, a, 0.0f);
    };
    to(n.x, g.x), to(n.y, g.y), to(n.z, g.z);
}
EG_INLINE void write(raw::Float* d, int32_t first, raw::Mask live, const RawVec3& t) {
    d[first] = raw::select(live, t.x, 0.0f);
    d[first + 1] = raw::select(live, t.y, 0.0f);
    d[first + 2] = raw::select(live, t.z, 0.0f);
}
// 1 / a, or 0 where |a| is so small that the inverse would overflow.
EG_INLINE raw::Float finite_inverse(raw::Float a) {
    const raw::Mask fine = raw::abs(a) > 1e-30f;
    return raw::select(fine, 1.0f / raw::select(fine, a, 1.0f), 0.0f);
}

// 1 in the lanes of a mask, 0 in the others.
EG_INLINE raw::Float all_of(raw::Mask m) { return raw::select(m, raw::splat(1.0f), 0.0f); }

// ---- Triangles: the blocks M (a point at fixed barycentrics) and N (the area normal) ----

EG_INLINE bool taped(const Triangle& t) {
    return taped(nodes(t.p0)) || taped(nodes(t.p1)) || taped(nodes(t.p2));
}

EG_INLINE PlacedTriangle detach(const PlacedTriangle& t) {
    return {{detach(t.triangle.p0), detach(t.triangle.p1), detach(t.triangle.p2)}, detach(t.handed)};
}

struct RawTriangle {
    Nodes3 corner[3];
    RawVec3 e1, e2;
    raw::Float b1, b2;

    EG_INLINE void set(const Triangle& t, raw::Float at1, raw::Float at2) {
        corner[0] = nodes(t.p0), corner[1] = nodes(t.p1), corner[2] = nodes(t.p2);
        e1 = values(t.p1) - values(t.p0), e2 = values(t.p2) - values(t.p0);
        b1 = at1, b2 = at2;
    }
    EG_INLINE bool moves() const { return taped(corner[0]) || taped(corner[1]) || taped(corner[2]); }
    // Adds to the corners' adjoints, given the adjoints of the point and of the area normal.
    EG_INLINE void backward(raw::Float* d, raw::Mask live, const RawVec3& point,
                            const RawVec3& normal) const {
        if (!moves()) return;
        const RawVec3 n1 = cross(e2, normal), n2 = cross(normal, e1);
        const RawVec3 g1 = point * b1 + n1, g2 = point * b2 + n2;
        add(d, corner[0], live, point - g1 - g2);
        add(d, corner[1], live, g1);
        add(d, corner[2], live, g2);
    }
    // Computes the tangents of the point and of the area normal. Returns the lanes in which a corner moves.
    EG_INLINE raw::Mask forward(const raw::Float* d, RawVec3& point, RawVec3& normal) const {
        const RawVec3 t0 = read(d, corner[0]), t1 = read(d, corner[1]), t2 = read(d, corner[2]);
        const RawVec3 d1 = t1 - t0, d2 = t2 - t0;
        point = t0 + d1 * b1 + d2 * b2;
        normal = cross(d1, e2) + cross(e1, d2);
        return nonzero(t0) | nonzero(t1) | nonzero(t2);
    }
};

// ---- The surface point that a ray has hit: blocks M, N and S ----
//
// In material form the point keeps its barycentrics. In screen form it stays on the ray from + t direction.
// With the velocity c of the ray's point and the velocity m of the triangle's point, it moves with
//   c + direction n.(m - c) / (n.direction)   (derivations, section 1),
// and its barycentrics change by grad(b).(its velocity - m). Near contact both forms are blended
// (scene/contact.h). Results: position, unit normal, barycentrics.
struct MetPoint {
    static constexpr int kResults = 8;
    int32_t first;
    Nodes3 from, direction;
    RawTriangle triangle;
    raw::Float screen_form;  // weight of the screen form
    RawVec3 d, n;            // direction of the ray; unit normal along e1 x e2
    raw::Float t;            // the ray's parameter
    raw::Float inverse;      // 1 / (n . d)
    raw::Float inverse_m;    // 1 / |e1 x e2|
    raw::Float side;         // of the normal

    // Gradients of the barycentrics.
    EG_INLINE RawVec3 gradient1() const { return cross(triangle.e2, n) * inverse_m; }
    EG_INLINE RawVec3 gradient2() const { return cross(n, triangle.e1) * inverse_m; }

    void backward(raw::Float* a) const {
        const RawVec3 position = read(a, first), normal = read(a, first + 3);
        const raw::Float b1 = a[first + 6], b2 = a[first + 7];
        const raw::Mask some = screen_form > 0.0f;
        const raw::Mask by_place = nonzero(position) | (((b1 != 0.0f) | (b2 != 0.0f)) & some);
        const raw::Mask live = by_place | nonzero(normal);
        if (!raw::any(live)) return;
        RawVec3 point = position;
        if (raw::any(by_place & some)) {
            const RawVec3 places = gradient1() * b1 + gradient2() * b2;
            const RawVec3 g = position + places;
            const RawVec3 of_ray = select(some, (g - n * (dot(g, d) * inverse)) * screen_form, raw_zero3());
            point = position - of_ray;
            add(a, from, by_place, of_ray);
            add(a, direction, by_place, of_ray * t);
        }
        triangle.backward(a, live, point, across(normal, n) * (side * inverse_m));
    }
    void forward(raw::Float* a) const {
        RawVec3 m, area_normal;
        raw::Mask live = triangle.forward(a, m, area_normal);
        RawVec3 position = m;
        const raw::Mask some = screen_form > 0.0f;
        if (raw::any(some)) {
            const RawVec3 start = read(a, from), turn = read(a, direction), c = start + turn * t;
            live |= some & (nonzero(start) | nonzero(turn));
            const RawVec3 behind = m - c;
            const RawVec3 relative =
                select(some, (d * (dot(n, behind) * inverse) - behind) * screen_form, raw_zero3());
            position = m + relative;
            a[first + 6] = raw::select(live, dot(gradient1(), relative), 0.0f);
            a[first + 7] = raw::select(live, dot(gradient2(), relative), 0.0f);
        }
        write(a, first, live, position);
        write(a, first + 3, live, across(area_normal, n) * (side * inverse_m));
    }
};

// Gives a constant surface point its derivatives. `t` is its triangle, seen along the ray from `from`;
// `screen_form` is the weight of the screen form.
EG_INLINE void move_met_point(SurfacePoint& x, const Triangle& t, raw::Float screen_form, Vec3 from,
                              Vec3 direction) {
    const bool by_ray = raw::any(screen_form > 0.0f) && (taped(nodes(from)) || taped(nodes(direction)));
    if (!taped(t) && !by_ray) return;
    MetPoint& block = current_tape->new_block<MetPoint>();
    const int32_t first = block.first;
    block.from = nodes(from), block.direction = nodes(direction);
    block.triangle.set(t, x.b1.value, x.b2.value);
    block.screen_form = screen_form;
    block.d = values(direction);
    const RawVec3 m = cross(block.triangle.e1, block.triangle.e2);
    block.inverse_m = finite_inverse(raw::sqrt(dot(m, m)));
    block.n = m * block.inverse_m;
    block.side = raw::select(dot(block.n, values(x.normal)) < 0.0f, raw::splat(-1.0f), 1.0f);
    block.t = dot(values(x.position) - values(from), block.d) * finite_inverse(dot(block.d, block.d));
    block.inverse = finite_inverse(dot(block.n, block.d));
    x.position = results(values(x.position), first);
    x.normal = results(values(x.normal), first + 3);
    if (by_ray || raw::any(screen_form > 0.0f)) x.b1.node = first + 6, x.b2.node = first + 7;
}

// ---- Unit vectors ----

struct Unit {
    static constexpr int kResults = 3;
    int32_t first;
    Nodes3 of;
    RawVec3 n;
    raw::Float inverse;  // 1 / length

    void backward(raw::Float* a) const {
        const RawVec3 g = read(a, first);
        add(a, of, nonzero(g), across(g, n) * inverse);
    }
    void forward(raw::Float* a) const {
        const RawVec3 t = read(a, of);
        write(a, first, nonzero(t), across(t, n) * inverse);
    }
};

EG_INLINE Vec3 unit(Vec3 v) {
    const RawVec3 a = values(v);
    const raw::Float inverse = finite_inverse(raw::sqrt(dot(a, a)));
    const RawVec3 n = a * inverse;
    if (!taped(nodes(v))) return constant3(n);
    Unit& block = current_tape->new_block<Unit>();
    block.of = nodes(v), block.n = n, block.inverse = inverse;
    return results(n, block.first);
}

// ---- Diffuse reflection ----

// Diffuse reflection of light from up to three directions: albedo / pi * sum of max(n.w, 0) * light.
struct DiffuseBlock {
    static constexpr int kResults = 3, kMost = 3;
    int32_t first, count;
    Nodes3 normal, albedo, w[kMost], light[kMost];
    RawVec3 n, color, from[kMost], value[kMost];
    raw::Float factor[kMost];  // 1 / pi, or 0 where the light is not active or below the horizon

    void backward(raw::Float* a) const {
        const RawVec3 g = read(a, first), of_color = g * color;
        const raw::Mask live = nonzero(g);
        if (!raw::any(live)) return;
        RawVec3 to_normal = raw_zero3(), to_albedo = raw_zero3();
        for (int k = 0; k < count; ++k) {
            const raw::Float density = dot(n, from[k]) * factor[k],
                             turn = dot(of_color, value[k]) * factor[k];
            to_albedo = to_albedo + value[k] * density;
            to_normal = to_normal + from[k] * turn;
            add(a, w[k], live, n * turn);
            add(a, light[k], live, of_color * density);
        }
        add(a, normal, live, to_normal);
        add(a, albedo, live, to_albedo * g);
    }
    void forward(raw::Float* a) const {
        const RawVec3 n_change = read(a, normal), color_change = read(a, albedo);
        RawVec3 sum = raw_zero3();
        raw::Mask live = nonzero(n_change) | nonzero(color_change);
        for (int k = 0; k < count; ++k) {
            const RawVec3 turn = read(a, w[k]), brighten = read(a, light[k]);
            live |= nonzero(turn) | nonzero(brighten);
            const raw::Float density = dot(n, from[k]) * factor[k];
            const raw::Float change = (dot(n_change, from[k]) + dot(n, turn)) * factor[k];
            sum = sum + color_change * value[k] * density + color * value[k] * change +
                  color * brighten * density;
        }
        write(a, first, live, sum);
    }
};

struct DiffuseLight {
    Mask active;
    Vec3 w, value;
};

EG_INLINE Vec3 diffuse_reflection(Vec3 normal, Vec3 albedo, int count, const DiffuseLight* lights) {
    DiffuseBlock local;
    bool recorded = taped(nodes(normal)) || taped(nodes(albedo));
    for (int k = 0; k < count; ++k) recorded |= taped(nodes(lights[k].w)) || taped(nodes(lights[k].value));
    DiffuseBlock& block = recorded ? current_tape->new_block<DiffuseBlock>() : local;
    block.count = count;
    block.normal = nodes(normal), block.albedo = nodes(albedo);
    block.n = values(normal), block.color = values(albedo);
    RawVec3 sum = raw_zero3();
    for (int k = 0; k < count; ++k) {
        block.w[k] = nodes(lights[k].w), block.light[k] = nodes(lights[k].value);
        block.from[k] = values(lights[k].w);
        block.value[k] = select(lights[k].active, values(lights[k].value), raw_zero3());
        const raw::Float cosine = dot(block.n, block.from[k]);
        block.factor[k] = raw::select(lights[k].active & (cosine > 0.0f), raw::splat(kInvPi), 0.0f);
        sum = sum + block.value[k] * (cosine * block.factor[k]);
    }
    sum = sum * block.color;
    return recorded ? results(sum, block.first) : constant3(sum);
}

}  // namespace edgegrad::EDGEGRAD_ISA
