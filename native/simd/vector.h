// Three-vectors of packets.
#pragma once

#include "simd/packet.h"

namespace edgegrad::EDGEGRAD_ISA {

struct Vec3 {
    Float x, y, z;
};

EG_INLINE Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
EG_INLINE Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
EG_INLINE Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
EG_INLINE Vec3 operator*(Vec3 a, Vec3 b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
EG_INLINE Vec3 operator*(Vec3 a, Float s) { return {a.x * s, a.y * s, a.z * s}; }
EG_INLINE Vec3 operator*(Float s, Vec3 a) { return a * s; }
EG_INLINE Float dot(Vec3 a, Vec3 b) { return sum_of_products(a.x, b.x, a.y, b.y, a.z, b.z); }
EG_INLINE Vec3 cross(Vec3 a, Vec3 b) {
    return {difference_of_products(a.y, b.z, a.z, b.y), difference_of_products(a.z, b.x, a.x, b.z),
            difference_of_products(a.x, b.y, a.y, b.x)};
}
EG_INLINE Vec3 select(Mask m, Vec3 a, Vec3 b) {
    return {select(m, a.x, b.x), select(m, a.y, b.y), select(m, a.z, b.z)};
}
EG_INLINE Vec3 detach(Vec3 a) { return {detach(a.x), detach(a.y), detach(a.z)}; }
EG_INLINE Vec3 zero3() { return {splat(0.0f), splat(0.0f), splat(0.0f)}; }
EG_INLINE Vec3 gray(Float a) { return {a, a, a}; }
EG_INLINE Vec3 one3() { return gray(splat(1.0f)); }
EG_INLINE Vec3 splat3(const float* v) { return {broadcast(v), broadcast(v + 1), broadcast(v + 2)}; }
template <typename R>
EG_INLINE Vec3 gather3(const float* base, const R& row) {
    Float r[3];
    gather_row(base, 3, row, r);
    return {r[0], r[1], r[2]};
}
// A vector divided by its length; 0 remains 0.
EG_INLINE Vec3 unit_vector(Vec3 a) { return a * (1.0f / max(sqrt(dot(a, a)), 1e-30f)); }
EG_INLINE Float largest_component(Vec3 a) { return max(max(abs(a.x), abs(a.y)), abs(a.z)); }

// Two unit vectors that complete the unit vector n to an orthonormal basis, without a branch
// (Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
EG_INLINE void basis(Vec3 n, Vec3& a, Vec3& b) {
    const Float sign = select(n.z >= 0.0f, splat(1.0f), -1.0f);
    const Float p = -1.0f / (sign + n.z);
    const Float q = n.x * n.y * p;
    a = {1.0f + sign * n.x * n.x * p, sign * q, -sign * n.x};
    b = {q, sign + n.y * n.y * p, -n.y};
}

}  // namespace edgegrad::EDGEGRAD_ISA
