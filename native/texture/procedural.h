// Blender's procedural textures as instructions of texture programs: checkers, bricks, and the parameters of
// noises (texture/noise.h, texture/hash.h) and cells (texture/voronoi.h).
#pragma once

#include <cstdint>
#include <limits>

#include "texture/hash.h"
#include "texture/image.h"
#include "texture/noise.h"
#include "texture/registers.h"
#include "texture/voronoi.h"

namespace edgegrad::EDGEGRAD_ISA {

// 1 where a checkerboard of unit cubes has its first colour.
EG_INLINE Float checker(Vec3 p) {
    const auto cell = [](Float x) { return floor((x + 0.000001f) * 0.999999f); };
    const Float half = 0.5f * (cell(p.x) + cell(p.y) + cell(p.z));
    return select(half == floor(half), splat(0.0f), 1.0f);
}

template <int N>
EG_INLINE NoisePoint<N> noise_point(const Float (&x)[4]) {
    NoisePoint<N> p;
    if constexpr (N == 1)
        p.x[0] = x[3];
    else
        for (int k = 0; k < N; ++k) p.x[k] = x[k];
    return p;
}

// Calls run(point) with the coordinates in the first four inputs. Bits of the instruction's data:
// dimensions - 1 (2 bits).
template <typename Run>
EG_INLINE void at_noise_point(const TextureRegisters& r, const Run& run) {
    const Float x[4] = {r.in(0), r.in(1), r.in(2), r.in(3)};
    switch (r.at->data & 3) {
        case 0:
            return run(noise_point<1>(x));
        case 1:
            return run(noise_point<2>(x));
        case 2:
            return run(noise_point<3>(x));
        default:
            return run(noise_point<4>(x));
    }
}

// Blender's White Noise Texture. Bits of the data: dimensions - 1 (2 bits), whether a colour is requested.
EG_INLINE Vec3 white_noise(const TextureRegisters& r) {
    const Float x[4] = {r.in(0), r.in(1), r.in(2), r.in(3)}, one = splat(1.0f), two = splat(2.0f);
    Float out[3] = {};
    const bool color = r.at->data & 4;
    switch (r.at->data & 3) {
        case 0:
            out[0] = hash1(x[3]);
            if (color) out[1] = hash2(x[3], one), out[2] = hash2(x[3], two);
            break;
        case 1:
            out[0] = hash2(x[0], x[1]);
            if (color) out[1] = hash3(x[0], x[1], one), out[2] = hash3(x[0], x[1], two);
            break;
        case 2:
            out[0] = hash3(x[0], x[1], x[2]);
            if (color) out[1] = hash4(x[0], x[1], x[2], one), out[2] = hash4(x[0], x[1], x[2], two);
            break;
        default:
            out[0] = hash4(x[0], x[1], x[2], x[3]);
            if (color) out[1] = hash4(x[2], x[0], x[3], x[1]), out[2] = hash4(x[3], x[2], x[1], x[0]);
    }
    return {out[0], out[1], out[2]};
}

EG_INLINE Vec3 noise(const TextureRegisters& r) {
    const int32_t data = r.at->data;
    const NoiseShape shape = {r.in(4), r.in(5), r.in(6), r.in(7), r.in(8), (data & 32) != 0};
    const Float distortion = r.in(9);
    const int32_t kind = (data >> 2) & 7;
    const bool color = data & 64;
    Float out[3] = {};
    at_noise_point(r, [&]<int N>(const NoisePoint<N>& point)
                          EG_INLINE_LAMBDA { noise_texture<N>(kind, point, shape, distortion, color, out); });
    return {out[0], out[1], out[2]};
}

EG_INLINE Color4 voronoi(const TextureRegisters& r) {
    const int32_t data = r.at->data;
    const VoronoiShape shape = {(data >> 2) & 7, (data >> 5) & 3, (data >> 8) & 3, (data & 128) != 0,
                                r.in(4),         r.in(5),         r.in(6),         r.in(7),
                                r.in(8),         r.in(9)};
    Color4 out{};
    at_noise_point(r, [&]<int N>(const NoisePoint<N>& point)
                          EG_INLINE_LAMBDA { voronoi_texture<N>(shape, point, out.c); });
    return out;
}

// The row or column of bricks at a place in units of their size. Where no integer can represent it, as with a
// size of 0, it is the least integer, to which Cycles' conversion leads on x86.
EG_INLINE Int brick_index(Float place) {
    const Float index = floor(place);
    const auto exists = abs(index) < 2147483648.0f;
    return select(exists, to_int(select(exists, index, 0.0f)), splat(std::numeric_limits<int32_t>::min()));
}

// Blender's Brick Texture: the tint of the brick, and 1 in the mortar. `data`: the number of rows after which
// bricks are shifted, and (upper half) squashed.
EG_INLINE Vec3 brick(const TextureRegisters& r) {
    const int32_t offset_rows = r.at->data & 0xffff, squash_rows = r.at->data >> 16;
    const Float x = r.in(0), y = r.in(1), mortar_size = r.in(2), mortar_smooth = r.in(3), bias = r.in(4);
    const Float height = r.in(6), shift = r.in(7), squash = r.in(8);
    Float width = r.in(5);
    const Int row = brick_index(y / height);
    const auto every = [&](int32_t n) { return wrap_index(row, n) == 0; };
    Float offset = splat(0.0f);
    if (offset_rows && squash_rows) {
        width = select(every(squash_rows), width * squash, width);
        offset = select(every(offset_rows), width * shift, 0.0f);
    }
    const Int column = brick_index((x + offset) / width);
    const Float in_x = x + offset - width * to_float(column), in_y = y - height * to_float(row);
    // An integer noise of row and brick.
    UInt n = (bits(row) << 16) + (bits(column) & 0xffffu);
    n = (n + 1013u) & 0x7fffffffu;
    n = (n >> 13) ^ n;
    n = (n * (n * n * 60493u + 19990303u) + 1376312589u) & 0x7fffffffu;
    const Float tint = saturate(0.5f * (to_float(bits(n)) * (1.0f / 1073741824.0f)) + bias);
    const Float border = min(min(in_x, in_y), min(width - in_x, height - in_y));
    const Float t = saturate(safe_divide(1.0f - safe_divide(border, mortar_size), mortar_smooth));
    const Float soft = select(mortar_smooth == 0.0f, splat(1.0f), t * t * (3.0f - 2.0f * t));
    return {tint, select(border >= mortar_size, splat(0.0f), soft), splat(0.0f)};
}

}  // namespace edgegrad::EDGEGRAD_ISA
