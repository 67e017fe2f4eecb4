// Lookups in images, tables and mesh attributes.
//
// Pixel (i, j), counted from the lower left corner, covers [i, i + 1) x [j, j + 1) of (u width, v height).
// Its value applies at its centre, as in Cycles (kernel/device/cpu/image.h). Rows are stored from the top.
#pragma once

#include "scene/textures/texture_view.h"
#include "simd/elementary.h"
#include "texture/texels.h"

namespace edgegrad::EDGEGRAD_ISA {

// i modulo n for n > 0 and |i| < 2^22; an arbitrary number otherwise. Computed on bits because the product
// may overflow.
EG_INLINE Int wrap_index(Int i, int32_t n) {
    const Float turns = floor((to_float(i) + 0.5f) * (1.0f / static_cast<float>(n)));
    return bits(bits(i) - bits(to_int(turns)) * static_cast<uint32_t>(n));
}

// The pixel of coordinate i, always within the image.
EG_INLINE Int extend_index(Int i, int32_t n, int32_t extension) {
    if (extension == kImageRepeat) i = wrap_index(i, n);
    if (extension == kImageMirror) {
        i = wrap_index(i, 2 * n);
        i = select(i >= n, 2 * n - 1 - i, i);
    }
    i = select(i < 0, splat(0), i);
    return select(i >= n, splat(n - 1), i);
}

// u n, reduced to the range in which integers are exact.
EG_INLINE Float pixel_coordinate(Float u, int32_t n, int32_t extension) {
    if (extension == kImageRepeat) u = fract(u);
    if (extension == kImageMirror) u = u - 2.0f * floor(0.5f * u);
    const Float x = u * static_cast<float>(n);
    return clamp(x, splat(-4.0f), splat(2.0f * static_cast<float>(n) + 4.0f));
}

// The pixels along one axis that a lookup reads, and their weights.
template <int Taps>
struct AxisTaps {
    Int index[Taps];
    Float weight[Taps];
    Float sum;  // of the weights; less than 1 at a clipped border
};

template <int Taps>
EG_INLINE AxisTaps<Taps> axis_taps(Float u, int32_t n, int32_t extension) {
    AxisTaps<Taps> r;
    const Float x = pixel_coordinate(u, n, extension) - (Taps == 1 ? 0.0f : 0.5f);
    const Float whole = floor(x);
    const Float t = x - whole;
    if constexpr (Taps == 1) {
        r.weight[0] = splat(1.0f);
    } else if constexpr (Taps == 2) {
        r.weight[0] = 1.0f - t;
        r.weight[1] = t;
    } else {  // cubic B-spline
        const Float s = 1.0f - t;
        r.weight[0] = s * s * s * (1.0f / 6);
        r.weight[1] = (t * t * (3.0f * t - 6.0f) + 4.0f) * (1.0f / 6);
        r.weight[2] = (s * s * (3.0f * s - 6.0f) + 4.0f) * (1.0f / 6);
        r.weight[3] = t * t * t * (1.0f / 6);
    }
    r.sum = splat(0.0f);
    for (int k = 0; k < Taps; ++k) {
        const Int i = to_int(whole) + (Taps == 4 ? k - 1 : k);  // may be outside the image
        if (extension == kImageClip) r.weight[k] = select((i >= 0) & (i < n), r.weight[k], 0.0f);
        r.sum += r.weight[k];
        r.index[k] = extend_index(i, n, extension);
    }
    return r;
}

template <int Taps>
EG_INLINE Color4 filter_image(const TextureImage& image, const float* pixels, Float u, Float v) {
    const AxisTaps<Taps> x = axis_taps<Taps>(u, image.width, image.extension);
    const AxisTaps<Taps> y = axis_taps<Taps>(v, image.height, image.extension);
    const int channels = image.channels, stride = image.width * channels;
    Rows index[Taps * Taps];
    Float weight[Taps * Taps];
    for (int j = 0; j < Taps; ++j) {
        const Int row = (image.height - 1 - y.index[j]) * stride;
        for (int i = 0; i < Taps; ++i) {
            store(index[j * Taps + i], row + x.index[i] * channels);
            weight[j * Taps + i] = y.weight[j] * x.weight[i];
        }
    }
    Color4 r = sum_texels(pixels + image.offset, index, weight, channels);
    if (channels == 1) r.c[1] = r.c[2] = r.c[0];
    if (channels != 4) {  // opaque within the image, transparent outside
        r.c[3] = splat(1.0f);
        if (image.extension == kImageClip) r.c[3] = x.sum * y.sum;
    }
    return r;
}

// Looks an image up at (u, v). Coordinates that are not finite give any of its pixels.
EG_INLINE Color4 lookup_image(const TextureView& textures, int32_t number, Float u, Float v) {
    const TextureImage& image = textures.images[number];
    Color4 r;
    if (image.interpolation == kImageClosest)
        r = filter_image<1>(image, textures.pixels, u, v);
    else if (image.interpolation == kImageCubic)
        r = filter_image<4>(image, textures.pixels, u, v);
    else
        r = filter_image<2>(image, textures.pixels, u, v);
    if (image.unassociate) {
        const Float scale = 1.0f / select(r.c[3] == 0.0f, splat(1.0f), r.c[3]);
        for (int k = 0; k < 3; ++k) r.c[k] *= scale;
    }
    return r;
}

// Looks a table up at x in [0, 1].
EG_INLINE Color4 lookup_table(const TextureView& textures, int32_t number, Float x) {
    const TextureLookup& table = textures.tables[number];
    const int last = table.rows - 1;
    const Float scaled = saturate(x) * static_cast<float>(last);
    Int i = to_int(scaled);
    i = select(i < 0, splat(0), select(i >= last, splat(last), i));  // NaN gives row 0
    const Float t = table.interpolate ? scaled - to_float(i) : splat(0.0f);
    Rows index[2];
    store(index[0], i * table.columns);
    store(index[1], select(i >= last, splat(last), i + 1) * table.columns);
    const Float weight[2] = {1.0f - t, t};
    const float* rows = textures.lookups + table.offset;
    Color4 r = sum_texels(rows, index, weight, table.columns);
    if (table.extrapolate) {
        const Float over = max(x - 1.0f, 0.0f) * static_cast<float>(last);
        const Float under = max(-x, 0.0f) * static_cast<float>(last);
        for (int k = 0; k < table.columns; ++k) {
            const Float first_step = broadcast(rows + k) - broadcast(rows + table.columns + k);
            const float* end = rows + last * table.columns + k;
            r.c[k] += over * (broadcast(end) - broadcast(end - table.columns)) + under * first_step;
        }
    }
    return r;
}

// Components that an attribute of `components` values lacks: one value is repeated, the third of two is 0,
// and the fourth is 1. All are 0 where there is no attribute.
EG_INLINE Color4 with_all_components(Color4 r, Int components) {
    const Mask single = components == 1;
    for (int k = 0; k < 4; ++k) {
        const Float missing = select((components == 0) | (k == 2 ? splat(-1) : splat(0)), splat(0.0f), 1.0f);
        r.c[k] = select(components > k, r.c[k], select(single, r.c[0], missing));
    }
    return r;
}

// Interpolates a mesh attribute, or takes the value of the instance; 0 where the mesh has none, or for the
// face -1.
EG_INLINE Color4 lookup_attribute(const TextureView& textures, int32_t number, Int face, Int instance,
                                  Float b1, Float b2) {
    const TextureAttribute* of_mesh = textures.mesh_attributes + number * textures.mesh_count;
    Rows index[3];
    Int components;
    Mask by_instance = splat(0);
    int most = 0;
    for (int lane = 0; lane < W; ++lane) {
        const int64_t f = face[lane];
        const TextureAttribute a = f < 0 ? TextureAttribute{} : of_mesh[textures.face_mesh[f]];
        const bool one_value = a.components < 0;
        // Inactive lanes may have no instance.
        const int n = !one_value ? a.components : instance[lane] >= 0 ? -a.components : 0;
        const int64_t row = one_value ? int64_t{instance[lane]} : 3 * f;
        const int32_t at = n ? static_cast<int32_t>(a.offset + row * n) : 0;
        for (int k = 0; k < 3; ++k) index[k][lane] = one_value ? at : at + k * n;
        components[lane] = n;
        if (one_value) by_instance[lane] = -1;
        if (n > most) most = n;
    }
    if (most == 0) return {splat(0.0f), splat(0.0f), splat(0.0f), splat(0.0f)};
    // The weights of corners add to 1 but for rounding; one value must keep its bits.
    const Float weight[3] = {select(by_instance, splat(1.0f), 1.0f - b1 - b2),
                             select(by_instance, splat(0.0f), b1), select(by_instance, splat(0.0f), b2)};
    return with_all_components(sum_texels(textures.attributes, index, weight, most), components);
}

}  // namespace edgegrad::EDGEGRAD_ISA
