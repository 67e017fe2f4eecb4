// Packets that record how they were computed: the `Float` of code that is differentiated.
//
// A translation unit includes this file first. Everything that it includes afterwards is compiled with this
// `Float` into the namespace EDGEGRAD_ADJOINT_ISA, so that derivatives use the same code as pictures.
// Integers and masks stay plain packets: branches, selections and rounding to integers are not
// differentiated.
//
// Where a function has no derivative, the one that keeps sums finite is used: 0 for a square root at 0
// (reached behind a guard max(x, 0), whose derivative is 0 too), for an angle at the origin, and for the
// inverse sine at its ends.
#pragma once

#include "adjoint/tape.h"
#include "simd/elementary.h"

#undef EDGEGRAD_ISA
#define EDGEGRAD_ISA EDGEGRAD_ADJOINT_ISA
#define EDGEGRAD_TAPED 1

namespace edgegrad::EDGEGRAD_ISA {

using raw::any;
using raw::append;
using raw::bits;
using raw::first_lanes;
using raw::Int;
using raw::lane_index;
using raw::Mask;
using raw::packet;
using raw::Rows;
using raw::UInt;
using raw::W;

struct Float {
    raw::Float value;
    int32_t node = -1;  // node on the tape; -1: a constant

    float operator[](int lane) const { return value[lane]; }
};

EG_INLINE Float constant(raw::Float value) { return {value, -1}; }
EG_INLINE Float detach(Float a) { return {a.value, -1}; }
EG_INLINE Mask has_derivative(Float a) { return raw::splat(a.node >= 0 ? -1 : 0); }
// A number whose derivative is read or set directly (Tape::derivative, Tape::seed).
EG_INLINE Float input(raw::Float value) { return {value, current_tape ? current_tape->new_node() : -1}; }

// ---- Recording of results: the value, and its derivatives by the operands ----

EG_INLINE Float result(raw::Float value, Float a, raw::Float pa) {
    if (a.node < 0) return {value, -1};
    return {value, current_tape->record(a.node, pa)};
}
EG_INLINE Float result(raw::Float value, Float a, raw::Float pa, Float b, raw::Float pb) {
    if ((a.node & b.node) < 0) return {value, -1};
    return {value, current_tape->record(a.node, pa, b.node, pb)};
}

// ---- Constants ----

EG_INLINE Float splat(float s) { return {raw::splat(s), -1}; }
EG_INLINE Int splat(int s) { return raw::splat(s); }
EG_INLINE UInt splat(uint32_t s) { return raw::splat(s); }
template <typename E>
    requires std::is_enum_v<E>
EG_INLINE Int splat(E e) {
    return raw::splat(e);
}
EG_INLINE Float to_float(Int a) { return {raw::to_float(a), -1}; }
EG_INLINE Float to_float(UInt a) { return {raw::to_float(a), -1}; }
EG_INLINE Int to_int(Float a) { return raw::to_int(a.value); }
EG_INLINE Int to_index(Float a, int least, int most) { return raw::to_index(a.value, least, most); }
EG_INLINE UInt float_bits(Float a) { return raw::float_bits(a.value); }
EG_INLINE Float load(const float* p) { return {raw::load(p), -1}; }
EG_INLINE Int load(const int32_t* p) { return raw::load(p); }
EG_INLINE void store(float* p, Float a) { raw::store(p, a.value); }
EG_INLINE void store(int32_t* p, Int a) { raw::store(p, a); }

// ---- Arithmetic ----

// Adding a constant needs no node, because the derivative is 1.
EG_INLINE Float operator+(Float a, Float b) {
    if (b.node < 0) return {a.value + b.value, a.node};
    if (a.node < 0) return {a.value + b.value, b.node};
    return result(a.value + b.value, a, raw::splat(1.0f), b, raw::splat(1.0f));
}
EG_INLINE Float operator-(Float a, Float b) {
    if (b.node < 0) return {a.value - b.value, a.node};
    return result(a.value - b.value, a, raw::splat(1.0f), b, raw::splat(-1.0f));
}
EG_INLINE Float operator*(Float a, Float b) { return result(a.value * b.value, a, b.value, b, a.value); }
EG_INLINE Float operator/(Float a, Float b) {
    const raw::Float q = a.value / b.value;
    if ((a.node & b.node) < 0) return {q, -1};
    const raw::Float inverse = 1.0f / b.value;
    return {q, current_tape->record(a.node, inverse, b.node, -q * inverse)};
}
EG_INLINE Float operator+(Float a, float b) { return {a.value + b, a.node}; }
EG_INLINE Float operator+(float a, Float b) { return {a + b.value, b.node}; }
EG_INLINE Float operator-(Float a, float b) { return {a.value - b, a.node}; }
EG_INLINE Float operator-(float a, Float b) { return result(a - b.value, b, raw::splat(-1.0f)); }
EG_INLINE Float operator*(Float a, float b) { return result(a.value * b, a, raw::splat(b)); }
EG_INLINE Float operator*(float a, Float b) { return b * a; }
EG_INLINE Float operator/(Float a, float b) { return result(a.value / b, a, raw::splat(1.0f / b)); }
EG_INLINE Float operator/(float a, Float b) {
    const raw::Float q = a / b.value;
    return result(q, b, -q / b.value);
}
EG_INLINE Float operator-(Float a) { return result(-a.value, a, raw::splat(-1.0f)); }
EG_INLINE Float operator+(Float a) { return a; }

template <typename B>
EG_INLINE Float& operator+=(Float& a, B b) {
    return a = a + b;
}
template <typename B>
EG_INLINE Float& operator-=(Float& a, B b) {
    return a = a - b;
}
template <typename B>
EG_INLINE Float& operator*=(Float& a, B b) {
    return a = a * b;
}
template <typename B>
EG_INLINE Float& operator/=(Float& a, B b) {
    return a = a / b;
}

EG_INLINE Float sum_of_products(Float a, Float b, Float c, Float d, Float e, Float f) {
    const raw::Float r = raw::sum_of_products(a.value, b.value, c.value, d.value, e.value, f.value);
    if ((a.node & b.node & c.node & d.node & e.node & f.node) < 0) return {r, -1};
    return {r, current_tape->record(a.node, b.value, b.node, a.value, c.node, d.value, d.node, c.value,
                                    e.node, f.value, f.node, e.value)};
}
EG_INLINE Float difference_of_products(Float a, Float b, Float c, Float d) {
    const raw::Float r = raw::difference_of_products(a.value, b.value, c.value, d.value);
    if ((a.node & b.node & c.node & d.node) < 0) return {r, -1};
    return {r, current_tape->record(a.node, b.value, b.node, a.value, c.node, -d.value, d.node, -c.value)};
}

// a + (b - a) t, as one node.
EG_INLINE Float lerp(Float a, Float b, Float t) {
    const raw::Float step = b.value - a.value, r = a.value + step * t.value;
    if ((a.node & b.node & t.node) < 0) return {r, -1};
    return {r, current_tape->record(a.node, 1.0f - t.value, b.node, t.value, t.node, step)};
}
// Interpolation between the corners of a triangle, as one node.
EG_INLINE Float interpolate(Float p0, Float p1, Float p2, Float b1, Float b2) {
    const raw::Float e1 = p1.value - p0.value, e2 = p2.value - p0.value;
    const raw::Float r = p0.value + e1 * b1.value + e2 * b2.value;
    if ((p0.node & p1.node & p2.node & b1.node & b2.node) < 0) return {r, -1};
    return {r, current_tape->record(p0.node, 1.0f - b1.value - b2.value, p1.node, b1.value, p2.node, b2.value,
                                    b1.node, e1, b2.node, e2)};
}

template <int N>
EG_INLINE Float sum_of_products(const Float (&a)[N], const Float (&b)[N]) {
    raw::Float r = a[0].value * b[0].value;
    for (int k = 1; k < N; ++k) r = r + a[k].value * b[k].value;
    int32_t nodes[2 * N];
    raw::Float partials[2 * N];
    int active = 0;
    for (int k = 0; k < N; ++k) {
        if (a[k].node >= 0) nodes[active] = a[k].node, partials[active++] = b[k].value;
        if (b[k].node >= 0) nodes[active] = b[k].node, partials[active++] = a[k].value;
    }
    return {r, active ? current_tape->record(active, nodes, partials) : -1};
}

// ---- Comparisons ----

#define EG_COMPARISON(op)                                                       \
    EG_INLINE Mask operator op(Float a, Float b) { return a.value op b.value; } \
    EG_INLINE Mask operator op(Float a, float b) { return a.value op b; }       \
    EG_INLINE Mask operator op(float a, Float b) { return a op b.value; }
EG_COMPARISON(<)
EG_COMPARISON(<=)
EG_COMPARISON(>)
EG_COMPARISON(>=)
EG_COMPARISON(==)
EG_COMPARISON(!=)
#undef EG_COMPARISON

// ---- Selections ----

// Selects one of two values by lane. Records nothing if all lanes agree.
EG_INLINE Float select(Mask m, Float a, Float b) {
    if ((a.node & b.node) < 0) return {raw::select(m, a.value, b.value), -1};
    if (!any(m)) return b;
    if (!any(~m)) return a;
    const raw::Float one = raw::select(m, raw::splat(1.0f), 0.0f);
    return {raw::select(m, a.value, b.value), current_tape->record(a.node, one, b.node, 1.0f - one)};
}
EG_INLINE Float select(Mask m, Float a, float b) { return select(m, a, splat(b)); }
EG_INLINE Int select(Mask m, Int a, Int b) { return raw::select(m, a, b); }

// Ties select the number, not the limit, so that the number keeps its derivative.
EG_INLINE Float min(Float a, Float b) { return select(a <= b, a, b); }
EG_INLINE Float max(Float a, Float b) { return select(a >= b, a, b); }
EG_INLINE Float max(Float a, float b) { return max(a, splat(b)); }
EG_INLINE Float abs(Float a) {
    return result(raw::abs(a.value), a, raw::select(a.value < 0.0f, raw::splat(-1.0f), 1.0f));
}
EG_INLINE Float clamp(Float a, Float low, Float high) { return min(max(a, low), high); }
EG_INLINE Float saturate(Float a) { return clamp(a, splat(0.0f), splat(1.0f)); }

// ---- Reading tables ----

EG_INLINE LeafNodes closures(const float* base, Int index, int count) {
    return current_tape ? current_tape->record_closures(base, index, count) : LeafNodes{};
}
EG_INLINE Float gather(const float* base, Int index) {
    return {raw::gather(base, index), closures(base, index, 1)[0]};
}
EG_INLINE Int gather(const int32_t* base, Int index) { return raw::gather(base, index); }
EG_INLINE Float broadcast(const float* p) { return {raw::broadcast(p), closures(p, raw::splat(0), 1)[0]}; }
template <int N, typename R>
EG_INLINE void gather_row(const float* base, int stride, const R& row, Float (&out)[N]) {
    raw::Float values[N];
    raw::gather_row(base, stride, row, values);
    const LeafNodes nodes = closures(base, packet(row) * stride, N);
    for (int k = 0; k < N; ++k) out[k] = {values[k], nodes[k]};
}

}  // namespace edgegrad::EDGEGRAD_ISA

// Single operations are always inlined, as for raw packets, because most of them have constant operands and
// reduce to a test and an instruction. The compiler decides about larger functions; inlining them all would
// make compilation very slow.
namespace edgegrad::EDGEGRAD_ISA {
inline Float sqrt(Float a);
}
#include "simd/vector.h"

#undef EG_INLINE
#undef EG_INLINE_LAMBDA
#define EG_INLINE inline
#define EG_INLINE_LAMBDA

namespace edgegrad::EDGEGRAD_ISA {

// ---- Integer parts and remainders ----

EG_INLINE Float floor(Float a) { return {raw::floor(a.value), -1}; }
EG_INLINE Float ceil(Float a) { return {raw::ceil(a.value), -1}; }
EG_INLINE Float trunc(Float a) { return {raw::trunc(a.value), -1}; }
EG_INLINE Float round(Float a) { return {raw::round(a.value), -1}; }
EG_INLINE Float fract(Float a) { return {raw::fract(a.value), a.node}; }
EG_INLINE Float fmod(Float a, Float b) {
    const raw::Float r = raw::fmod(a.value, b.value);
    const raw::Mask fine = b.value != 0.0f;
    const raw::Float quotient = raw::round((a.value - r) / b.value);
    return result(r, a, raw::select(fine, raw::splat(1.0f), 0.0f), b, raw::select(fine, -quotient, 0.0f));
}

// ---- Elementary functions ----

EG_INLINE Float sqrt(Float a) {
    const raw::Float r = raw::sqrt(a.value);
    if (a.node < 0) return {r, -1};
    return result(r, a, raw::select(r > 0.0f, 0.5f / r, 0.0f));
}
EG_INLINE Float exp(Float a) {
    const raw::Float r = raw::exp(a.value);
    return result(r, a, r);
}
EG_INLINE Float log(Float a) { return result(raw::log(a.value), a, 1.0f / a.value); }
EG_INLINE Float pow_positive(Float a, Float b) {
    const raw::Float r = raw::pow_positive(a.value, b.value);
    if ((a.node & b.node) < 0) return {r, -1};
    const raw::Float by_b = b.node < 0 ? raw::splat(0.0f) : r * raw::log(a.value);
    return {r, current_tape->record(a.node, b.value * r / a.value, b.node, by_b)};
}
EG_INLINE void sincos(Float a, Float& s, Float& c) {
    raw::Float sine, cosine;
    raw::sincos(a.value, sine, cosine);
    s = result(sine, a, cosine);
    c = result(cosine, a, -sine);
}
EG_INLINE void sincos_turn(Float a, Float& s, Float& c) {
    raw::Float sine, cosine;
    raw::sincos_turn(a.value, sine, cosine);
    s = result(sine, a, 6.283185307f * cosine);
    c = result(cosine, a, -6.283185307f * sine);
}
EG_INLINE Float sin(Float a) {
    Float s, c;
    sincos(a, s, c);
    return s;
}
EG_INLINE Float cos(Float a) {
    Float s, c;
    sincos(a, s, c);
    return c;
}
EG_INLINE Float atan2(Float y, Float x) {
    const raw::Float r = raw::atan2(y.value, x.value);
    if ((x.node & y.node) < 0) return {r, -1};
    const raw::Float square = x.value * x.value + y.value * y.value;
    const raw::Float inverse = raw::select(square > 0.0f, 1.0f / square, 0.0f);
    return {r, current_tape->record(y.node, x.value * inverse, x.node, -y.value * inverse)};
}
EG_INLINE raw::Float asin_derivative(raw::Float a) {
    const raw::Float square = (1.0f - a) * (1.0f + a);
    return raw::select(square > 0.0f, 1.0f / raw::sqrt(raw::max(square, 1e-37f)), 0.0f);
}
EG_INLINE Float asin(Float a) { return result(raw::asin(a.value), a, asin_derivative(a.value)); }
EG_INLINE Float acos(Float a) { return result(raw::acos(a.value), a, -asin_derivative(a.value)); }
EG_INLINE Float sinh(Float a) { return result(raw::sinh(a.value), a, raw::cosh(a.value)); }
EG_INLINE Float cosh(Float a) { return result(raw::cosh(a.value), a, raw::sinh(a.value)); }
EG_INLINE Float tanh(Float a) {
    const raw::Float r = raw::tanh(a.value);
    return result(r, a, 1.0f - r * r);
}

}  // namespace edgegrad::EDGEGRAD_ISA
