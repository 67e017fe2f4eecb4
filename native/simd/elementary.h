// Elementary functions of packets, accurate to about 1e-6 of the result (absolute near the zeros of sine and
// cosine). The polynomials are those of the Cephes library (Moshier 1989) for single precision.
#pragma once

#include "simd/packet.h"

namespace edgegrad::EDGEGRAD_ISA {

// Floats of 2^23 or more have no fraction.
EG_INLINE Float floor(Float a) {
    const Float t = to_float(to_int(a));
    return select(abs(a) < 8388608.0f, t - select(t > a, splat(1.0f), 0.0f), a);
}
EG_INLINE Float ceil(Float a) { return -floor(-a); }
EG_INLINE Float trunc(Float a) { return select(abs(a) < 8388608.0f, to_float(to_int(a)), a); }
EG_INLINE Float fract(Float a) { return a - floor(a); }
EG_INLINE Float round(Float a) { return floor(a + 0.5f); }
EG_INLINE Float clamp(Float a, Float low, Float high) { return min(max(a, low), high); }
EG_INLINE Float saturate(Float a) { return clamp(a, splat(0.0f), splat(1.0f)); }

// Remainder with the sign of a, as C's fmodf; 0 for b = 0.
EG_INLINE Float fmod(Float a, Float b) {
    const Float size = abs(b);
    Float r = a - trunc(a / b) * b;
    // Rounding may have moved the quotient across an integer.
    r = select((r < 0.0f) & (a > 0.0f), r + size, r);
    r = select((r > 0.0f) & (a < 0.0f), r - size, r);
    return select(b == 0.0f, splat(0.0f), r);
}

// 2^n for integer n in [-126, 127].
EG_INLINE Float power_of_two(Float n) { return reinterpret_cast<Float>((to_int(n) + 127) << 23); }

// e^r for |r| <= log(2) / 2.
EG_INLINE Float exp_reduced(Float r) {
    Float p = splat(1.9875691500e-4f);
    p = p * r + 1.3981999507e-3f;
    p = p * r + 8.3334519073e-3f;
    p = p * r + 4.1665795894e-2f;
    p = p * r + 1.6666665459e-1f;
    p = p * r + 5.0000001201e-1f;
    return p * r * r + r + 1.0f;
}

EG_INLINE Float exp(Float x) {
    const Float n = round(clamp(x, splat(-87.0f), splat(88.7f)) * 1.44269504f);
    const Float r = clamp(x, splat(-87.0f), splat(88.7f)) - n * 0.693359375f + n * 2.12194440e-4f;
    // Two factors, because n may be 128.
    const Float y = exp_reduced(r) * power_of_two(n - 1.0f) * 2.0f;
    return select(x > 88.7228f, splat(__builtin_inff()), select(x < -87.0f, splat(0.0f), y));
}

// Splits x = m 2^e with m in [sqrt(1/2), sqrt(2)), for x > 0. Returns log(m).
EG_INLINE Float log_mantissa(Float x, Float& e) {
    const Int i = reinterpret_cast<Int>(x);
    Float m = reinterpret_cast<Float>((i & 0x007fffff) | 0x3f000000);
    e = to_float((i >> 23) - 126);
    const Mask low = m < 0.707106781f;
    e = select(low, e - 1.0f, e);
    m = select(low, m + m, m) - 1.0f;
    Float p = splat(7.0376836292e-2f);
    p = p * m - 1.1514610310e-1f;
    p = p * m + 1.1676998740e-1f;
    p = p * m - 1.2420140846e-1f;
    p = p * m + 1.4249322787e-1f;
    p = p * m - 1.6668057665e-1f;
    p = p * m + 2.0000714765e-1f;
    p = p * m - 2.4999993993e-1f;
    p = p * m + 3.3333331174e-1f;
    const Float square = m * m;
    return m + (p * m * square - 0.5f * square);
}

// For x > 0.
EG_INLINE Float log(Float x) {
    Float e;
    const Float l = log_mantissa(x, e);
    return l - e * 2.12194440e-4f + e * 0.693359375f;
}

// a^b for a > 0. 2^(b e) and m^b are computed separately, so that large exponents lose no precision.
EG_INLINE Float pow_positive(Float a, Float b) {
    Float e;
    const Float l = log_mantissa(a, e);
    const Float whole = clamp(round(b * e + b * l * 1.44269504f), splat(-126.0f), splat(127.0f));
    const Float r = (b * e - whole) * 0.693147181f + b * l;
    const Float y = exp_reduced(clamp(r, splat(-1.0f), splat(1.0f))) * power_of_two(whole);
    return select(r < -1.0f, splat(0.0f), select(r > 1.0f, splat(__builtin_inff()), y));
}

EG_INLINE void sincos(Float x, Float& s, Float& c) {
    const Float n = round(x * 0.636619772f);
    // pi / 2 in three parts (Cody and Waite).
    const Float r = x - n * 1.5703125f - n * 4.83751296997e-4f - n * 7.54978994e-8f;
    const Float r2 = r * r;
    const Float sr = r + r * r2 * (-1.6666654611e-1f + r2 * (8.3321608736e-3f + r2 * -1.9515295891e-4f));
    const Float cr =
        1.0f - 0.5f * r2 +
        r2 * r2 * (4.166664568298827e-2f + r2 * (-1.388731625493765e-3f + r2 * 2.443315711809948e-5f));
    const Int quadrant = to_int(n);
    const Mask swap = (quadrant & 1) != 0;
    s = select(swap, cr, sr);
    c = select(swap, sr, cr);
    s = select((quadrant & 2) != 0, -s, s);
    c = select(((quadrant + 1) & 2) != 0, -c, c);
}
EG_INLINE Float sin(Float x) {
    Float s, c;
    sincos(x, s, c);
    return s;
}
EG_INLINE Float cos(Float x) {
    Float s, c;
    sincos(x, s, c);
    return c;
}

// Angle of the vector (x, y); 0 for the origin.
EG_INLINE Float atan2(Float y, Float x) {
    const Float ax = abs(x), ay = abs(y);
    const Mask steep = ay > ax;
    const Float low = min(ax, ay), high = max(ax, ay);
    Float t = select(high == 0.0f, splat(0.0f), low / high);
    // Above tan(pi / 8): atan(t) = pi / 4 + atan((t - 1) / (t + 1)).
    const Mask upper = t > 0.414213562f;
    t = select(upper, (t - 1.0f) / (t + 1.0f), t);
    const Float z = t * t;
    const Float p =
        ((8.05374449538e-2f * z - 1.38776856032e-1f) * z + 1.99777106478e-1f) * z - 3.33329491539e-1f;
    Float angle = select(upper, splat(0.785398163f), 0.0f) + (p * z * t + t);
    angle = select(steep, 1.57079633f - angle, angle);
    angle = select(x < 0.0f, 3.14159265f - angle, angle);
    return select(y < 0.0f, -angle, angle);
}
EG_INLINE Float asin(Float a) {
    const Float x = clamp(a, splat(-1.0f), splat(1.0f));
    return atan2(x, sqrt((1.0f - x) * (1.0f + x)));
}
EG_INLINE Float acos(Float a) {
    const Float x = clamp(a, splat(-1.0f), splat(1.0f));
    return atan2(sqrt((1.0f - x) * (1.0f + x)), x);
}

EG_INLINE Float sinh(Float x) {
    const Float x2 = x * x;
    const Float e = exp(abs(x));
    const Float y = 0.5f * (e - 1.0f / e);
    const Float series =
        x * (1.0f + x2 * (1.0f / 6 + x2 * (1.0f / 120 + x2 * (1.0f / 5040 + x2 * (1.0f / 362880)))));
    return select(abs(x) < 1.0f, series, select(x < 0.0f, -y, y));
}
EG_INLINE Float cosh(Float x) {
    const Float e = exp(abs(x));
    return 0.5f * (e + 1.0f / e);
}
EG_INLINE Float tanh(Float x) {
    const Float e = exp(2.0f * min(abs(x), splat(20.0f)));
    const Float y = 1.0f - 2.0f / (e + 1.0f);
    return select(abs(x) < 0.5f, sinh(x) / cosh(x), select(x < 0.0f, -y, y));
}

}  // namespace edgegrad::EDGEGRAD_ISA
