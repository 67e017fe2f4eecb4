// Linear interpolation in tables of one to three axes; the first axis is the fastest.
#pragma once

#include "simd/elementary.h"

namespace edgegrad::EDGEGRAD_ISA {

// A place between two neighbours of an axis with n entries, for x in [0, 1].
struct TablePlace {
    Int low;
    Float share;
};
EG_INLINE TablePlace table_place(Float x, int n) {
    const Float at = saturate(x) * static_cast<float>(n - 1);
    Int low = to_int(at);
    low = select(low > n - 2, splat(n - 2), low);
    return {low, at - to_float(low)};
}

EG_INLINE Float table_row(const float* table, Int first, TablePlace x) {
    const Float a = gather(table, first + x.low), b = gather(table + 1, first + x.low);
    return lerp(a, b, x.share);
}
EG_INLINE Float table_plane(const float* table, Int first, TablePlace x, TablePlace y, int n) {
    const Float a = table_row(table, first + y.low * n, x), b = table_row(table + n, first + y.low * n, x);
    return lerp(a, b, y.share);
}
EG_INLINE Float table_volume(const float* table, TablePlace x, TablePlace y, TablePlace z, int n) {
    const Float a = table_plane(table, z.low * (n * n), x, y, n);
    const Float b = table_plane(table + n * n, z.low * (n * n), x, y, n);
    return lerp(a, b, z.share);
}

}  // namespace edgegrad::EDGEGRAD_ISA
