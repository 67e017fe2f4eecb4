// Conversions between colour spaces (util/color.h in Cycles).
#pragma once

#include "simd/elementary.h"
#include "simd/vector.h"

namespace edgegrad::EDGEGRAD_ISA {

// a / b; 0 for b = 0.
EG_INLINE Float safe_divide(Float a, Float b) {
    const Mask zero = b == 0.0f;
    return select(zero, splat(0.0f), a / select(zero, splat(1.0f), b));
}

EG_INLINE Vec3 rgb_to_hsv(Vec3 c) {
    const Float high = max(c.x, max(c.y, c.z)), low = min(c.x, min(c.y, c.z));
    const Float delta = high - low;
    const Float s = safe_divide(delta, high);
    const Vec3 d = {safe_divide(high - c.x, delta), safe_divide(high - c.y, delta),
                    safe_divide(high - c.z, delta)};
    Float h = select(c.x == high, d.z - d.y, select(c.y == high, 2.0f + d.x - d.z, 4.0f + d.y - d.x));
    h *= 1.0f / 6;
    h = select(h < 0.0f, h + 1.0f, h);
    return {select(s == 0.0f, splat(0.0f), h), s, high};
}

EG_INLINE Vec3 hsv_to_rgb(Vec3 c) {
    const Float h = select(c.x == 1.0f, splat(0.0f), c.x) * 6.0f;
    const Float sextant = floor(h), f = h - sextant;
    const Float p = c.z * (1.0f - c.y), q = c.z * (1.0f - c.y * f), t = c.z * (1.0f - c.y * (1.0f - f));
    Vec3 r = {c.z, p, q};  // the last sextant, and colours outside the range
    r = select(sextant == 4.0f, Vec3{t, p, c.z}, r);
    r = select(sextant == 3.0f, Vec3{p, q, c.z}, r);
    r = select(sextant == 2.0f, Vec3{p, c.z, t}, r);
    r = select(sextant == 1.0f, Vec3{q, c.z, p}, r);
    r = select(sextant == 0.0f, Vec3{c.z, t, p}, r);
    return select(c.y == 0.0f, Vec3{c.z, c.z, c.z}, r);
}

EG_INLINE Vec3 rgb_to_hsl(Vec3 c) {
    const Float high = max(c.x, max(c.y, c.z)), low = min(c.x, min(c.y, c.z));
    const Float delta = high - low, l = min(splat(1.0f), (high + low) * 0.5f);
    const Float s = safe_divide(delta, select(l > 0.5f, 2.0f - high - low, high + low));
    const Float red = safe_divide(c.y - c.z, delta) + select(c.y < c.z, splat(6.0f), 0.0f);
    const Float green = safe_divide(c.z - c.x, delta) + 2.0f;
    const Float blue = safe_divide(c.x - c.y, delta) + 4.0f;
    const Float h = select(high == c.x, red, select(high == c.y, green, blue)) * (1.0f / 6);
    const Mask grey = delta == 0.0f;
    return {select(grey, splat(0.0f), h), select(grey, splat(0.0f), s), l};
}

EG_INLINE Vec3 hsl_to_rgb(Vec3 c) {
    const Float h = c.x * 6.0f;
    const Vec3 hue = {saturate(abs(h - 3.0f) - 1.0f), saturate(2.0f - abs(h - 2.0f)),
                      saturate(2.0f - abs(h - 4.0f))};
    const Float chroma = (1.0f - abs(2.0f * c.z - 1.0f)) * c.y;
    return {(hue.x - 0.5f) * chroma + c.z, (hue.y - 0.5f) * chroma + c.z, (hue.z - 0.5f) * chroma + c.z};
}

}  // namespace edgegrad::EDGEGRAD_ISA
