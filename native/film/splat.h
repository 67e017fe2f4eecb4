// The pixels that see a point of the picture, and their filter weights.
//
// A pixel's value is the mean of L over its filter: int h(s - centre) L(s) ds, where pictures sample the
// density h (film/pixel_filter.h). A curve that sweeps over the point s changes every pixel whose filter
// covers s, in proportion to h. (Rows of an equirectangular picture whose filters extend beyond a pole are
// left out.)
#pragma once

#include "scene/view.h"
#include "simd/elementary.h"
#include "simd/vector.h"

namespace edgegrad::EDGEGRAD_ISA {

// Density of the filter along one axis at an offset from the pixel's centre. It is constant between the
// entries of the inverse distribution, as pictures sample it.
EG_INLINE Float filter_density(const float* filter, Float offset) {
    const Mask inside = (offset >= filter[0]) & (offset < filter[kFilterSize]);
    Int low = splat(0), high = splat(kFilterSize);
    for (int size = kFilterSize; size > 1; size >>= 1) {
        const Int mid = (low + high) >> 1;
        const Mask right = gather(filter, mid) <= offset;
        low = select(right, mid, low);
        high = select(right, high, mid);
    }
    const Float width = gather(filter, low + 1) - gather(filter, low);
    return select(inside, (1.0f / kFilterSize) / max(width, 1e-12f), 0.0f);
}

// Width of the margin around the picture that its outer pixels' filters cover.
EG_INLINE float filter_margin(const CameraView& c) {
    const float reach = c.filter ? c.filter[kFilterSize] - 0.5f : 0.0f;
    return reach > 0.0f ? reach : 0.0f;
}

// Returns whether any pixel may see the point.
EG_INLINE Mask in_reach(const CameraView& c, Float sx, Float sy) {
    const float m = filter_margin(c);
    // A picture of the full turn has no left and right border.
    const bool turn = c.kind == kEquirectangular;
    const Mask x = turn ? splat(-1) : (sx >= -m) & (sx < static_cast<float>(c.width) + m);
    return x & (sy >= -m) & (sy < static_cast<float>(c.height) + m);
}

// Calls visit(lanes, pixel, weight) for the pixels that see (sx, sy).
template <typename Visit>
EG_INLINE void for_each_pixel(const CameraView& c, Mask active, Float sx, Float sy, const Visit& visit) {
    const bool turn = c.kind == kEquirectangular && __builtin_fabsf(c.panorama[1] - c.panorama[0]) > 6.2831f;
    const auto one = [&](Float column, Float row, Float weight) EG_INLINE_LAMBDA {
        // Columns of the full turn wrap around.
        const float full = static_cast<float>(c.full_width), first = static_cast<float>(c.window_x);
        if (turn) column = column - full * floor((column + first) * (1.0f / full));
        const Mask m = active & (column >= 0.0f) & (column < static_cast<float>(c.width)) & (row >= 0.0f) &
                       (row < static_cast<float>(c.height)) & (weight > 0.0f);
        const auto whole = [m](Float place) { return to_int(select(m, place, splat(0.0f))); };
        if (any(m)) visit(m, whole(row) * c.width + whole(column), weight);
    };
    if (!c.filter) {
        one(floor(sx), floor(sy), splat(1.0f));
        return;
    }
    const float reach = c.filter[kFilterSize];
    const int count = static_cast<int>(__builtin_ceilf(2.0f * reach)) + 1;
    const Float first_column = floor(sx - reach), first_row = floor(sy - reach);
    for (int j = 0; j < count; ++j) {
        const Float row = first_row + static_cast<float>(j);
        const Float by_row = filter_density(c.filter, sy - row - 0.5f);
        if (!any(active & (by_row > 0.0f))) continue;
        for (int i = 0; i < count; ++i) {
            const Float column = first_column + static_cast<float>(i);
            one(column, row, by_row * filter_density(c.filter, sx - column - 0.5f));
        }
    }
}

// Adds values at points of the picture to the pixels that see them.
EG_INLINE void add_at(const CameraView& c, Mask active, Float sx, Float sy, Vec3 value, float* image) {
    for_each_pixel(c, active, sx, sy, [&](Mask m, Int pixel, Float weight) EG_INLINE_LAMBDA {
        for (int i = 0; i < W; ++i) {
            if (!m[i]) continue;
            float* out = image + 3 * static_cast<int64_t>(pixel[i]);
            out[0] += weight[i] * value.x[i];
            out[1] += weight[i] * value.y[i];
            out[2] += weight[i] * value.z[i];
        }
    });
}

// The transpose: the derivative of sum(adjoint * picture) by a value at a point of the picture.
EG_INLINE Vec3 adjoint_at(const CameraView& c, Mask active, Float sx, Float sy, const float* adjoint) {
    Vec3 sum = zero3();
    for_each_pixel(c, active, sx, sy, [&](Mask m, Int pixel, Float weight) EG_INLINE_LAMBDA {
        sum = sum + select(m, gather3(adjoint, pixel) * weight, zero3());
    });
    return sum;
}

}  // namespace edgegrad::EDGEGRAD_ISA
