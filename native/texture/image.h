// Lookups in images, tables and mesh attributes.
//
// Pixel (i, j) counted from the lower left corner covers [i, i + 1) x [j, j + 1) of (u width, v height); its
// value holds at its centre, as in Cycles (kernel/device/cpu/image.h). Rows are stored from the top.
#pragma once

#include "simd/elementary.h"
#include "texture/view.h"

namespace edgegrad::EDGEGRAD_ISA {

// Four components; `Texel` is those of one lane.
struct Color4 {
    Float c[4];
};
typedef float Texel __attribute__((vector_size(16)));

// Reads four floats, whatever belongs to the pixel.
EG_INLINE Texel load_texel(const float* p) {
    Texel t;
    __builtin_memcpy(&t, p, sizeof t);
    return t;
}

// Lanes' texels as components.
struct Texels {
    Texel lane[W];
    EG_INLINE void set(int i, Texel t) { lane[i] = t; }
    EG_INLINE Color4 get() const {
        Color4 r;
        const float* p = reinterpret_cast<const float*>(lane);
        for (int k = 0; k < 4; ++k)
            for (int i = 0; i < W; ++i) r.c[k][i] = p[4 * i + k];
        return r;
    }
};

// i modulo n, n > 0, for |i| < 2^22.
EG_INLINE Int wrap_index(Int i, int32_t n) {
    const Float turns = floor((to_float(i) + 0.5f) * (1.0f / static_cast<float>(n)));
    return i - to_int(turns) * n;
}

// The pixel that coordinate i means, always within the image.
EG_INLINE Int extend_index(Int i, int32_t n, int32_t extension) {
    if (extension == kImageRepeat) i = wrap_index(i, n);
    if (extension == kImageMirror) {
        i = wrap_index(i, 2 * n);
        i = select(i >= n, 2 * n - 1 - i, i);
    }
    i = select(i < 0, splat(0), i);
    return select(i >= n, splat(n - 1), i);
}

// u n, reduced to where whole numbers are exact.
EG_INLINE Float pixel_coordinate(Float u, int32_t n, int32_t extension) {
    if (extension == kImageRepeat) u = fract(u);
    if (extension == kImageMirror) u = u - 2.0f * floor(0.5f * u);
    const Float x = u * static_cast<float>(n);
    return clamp(x, splat(-4.0f), splat(2.0f * static_cast<float>(n) + 4.0f));
}

// The pixels along one axis that a lookup reads, with their weights. By lane in memory: lanes are looked up
// one after the other, and packets are slow to take apart.
template <int Taps>
struct AxisTaps {
    int32_t index[Taps][W];
    float weight[Taps][W];
    Float sum;  // of the weights; less than 1 over a clipped border
};

template <int Taps>
EG_INLINE AxisTaps<Taps> axis_taps(Float u, int32_t n, int32_t extension) {
    AxisTaps<Taps> r;
    const Float x = pixel_coordinate(u, n, extension) - (Taps == 1 ? 0.0f : 0.5f);
    const Float whole = floor(x);
    const Float t = x - whole;
    Float weight[Taps];
    if constexpr (Taps == 1) {
        weight[0] = splat(1.0f);
    } else if constexpr (Taps == 2) {
        weight[0] = 1.0f - t;
        weight[1] = t;
    } else {  // cubic B-spline
        const Float s = 1.0f - t;
        weight[0] = s * s * s * (1.0f / 6);
        weight[1] = (t * t * (3.0f * t - 6.0f) + 4.0f) * (1.0f / 6);
        weight[2] = (s * s * (3.0f * s - 6.0f) + 4.0f) * (1.0f / 6);
        weight[3] = t * t * t * (1.0f / 6);
    }
    r.sum = splat(0.0f);
    for (int k = 0; k < Taps; ++k) {
        const Int i = to_int(whole) + (Taps == 4 ? k - 1 : k);
        if (extension == kImageClip) weight[k] = select((i >= 0) & (i < n), weight[k], 0.0f);
        r.sum += weight[k];
        store(r.weight[k], weight[k]);
        store(r.index[k], extend_index(i, n, extension));
    }
    return r;
}

template <int Taps>
EG_INLINE Color4 filter_image(const TextureImage& image, const float* pixels, Float u, Float v) {
    const AxisTaps<Taps> x = axis_taps<Taps>(u, image.width, image.extension);
    const AxisTaps<Taps> y = axis_taps<Taps>(v, image.height, image.extension);
    const int channels = image.channels;
    const float* base = pixels + image.offset;
    const int64_t stride = static_cast<int64_t>(image.width) * channels;
    Texels found;
    for (int lane = 0; lane < W; ++lane) {
        Texel sum{};
        for (int j = 0; j < Taps; ++j) {
            const float* row = base + (image.height - 1 - y.index[j][lane]) * stride;
            Texel line{};
            for (int i = 0; i < Taps; ++i)
                line += load_texel(row + x.index[i][lane] * channels) * x.weight[i][lane];
            sum += line * y.weight[j][lane];
        }
        found.set(lane, sum);
    }
    Color4 r = found.get();
    if (channels == 1) r.c[1] = r.c[2] = r.c[0];
    if (channels != 4) {  // opaque, but transparent outside of the image
        r.c[3] = splat(1.0f);
        if (image.extension == kImageClip) r.c[3] = x.sum * y.sum;
    }
    return r;
}

// An image at (u, v); not finite coordinates give any of its pixels.
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

// A table at x, [0, 1] being its whole length.
EG_INLINE Color4 lookup_table(const TextureView& textures, int32_t number, Float x) {
    const TextureLookup& table = textures.tables[number];
    const int last = table.rows - 1;
    const Float scaled = saturate(x) * static_cast<float>(last);
    Int i = to_int(scaled);
    i = select(i < 0, splat(0), select(i >= last, splat(last), i));  // not a number: row 0
    const Float t = table.interpolate ? scaled - to_float(i) : splat(0.0f);
    int32_t here[W], next[W];
    float share[W];
    store(here, i);
    store(next, select(i >= last, splat(last), i + 1));
    store(share, t);
    const float* rows = textures.lookups + table.offset;
    Texels found;
    for (int lane = 0; lane < W; ++lane) {
        const Texel a = load_texel(rows + here[lane] * table.columns);
        const Texel b = load_texel(rows + next[lane] * table.columns);
        found.set(lane, a * (1.0f - share[lane]) + b * share[lane]);
    }
    Color4 r = found.get();
    if (table.extrapolate) {
        const Float over = max(x - 1.0f, 0.0f) * static_cast<float>(last);
        const Float under = max(-x, 0.0f) * static_cast<float>(last);
        for (int k = 0; k < table.columns; ++k) {
            const float first_step = rows[k] - rows[table.columns + k];
            const float* end = rows + last * table.columns + k;
            r.c[k] += over * (*end - end[-table.columns]) + under * first_step;
        }
    }
    return r;
}

// A mesh attribute, interpolated; 0 where the mesh has none.
EG_INLINE Color4 lookup_attribute(const TextureView& textures, int32_t number, Int face, Float b1, Float b2) {
    const TextureAttribute* of_mesh = textures.mesh_attributes + number * textures.mesh_count;
    int32_t faces[W];
    float weight[3][W];
    store(faces, face);
    store(weight[0], 1.0f - b1 - b2);
    store(weight[1], b1);
    store(weight[2], b2);
    Texels found;
    for (int lane = 0; lane < W; ++lane) {
        const int64_t f = faces[lane];
        const TextureAttribute& a = of_mesh[textures.face_mesh[f]];
        const int n = a.components;
        const float* p = textures.attributes + (n ? a.offset + f * 3 * n : 0);
        Texel v = load_texel(p) * weight[0][lane] + load_texel(p + n) * weight[1][lane] +
                  load_texel(p + 2 * n) * weight[2][lane];
        if (n == 0) v = Texel{};
        if (n == 1) v = Texel{} + v[0];
        if (n == 2) v[2] = 0.0f;
        if (n == 2 || n == 3) v[3] = 1.0f;
        found.set(lane, v);
    }
    return found.get();
}

}  // namespace edgegrad::EDGEGRAD_ISA
