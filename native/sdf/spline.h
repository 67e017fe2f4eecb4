// The cubic B-spline of a field at one point, with its derivatives in grid coordinates. The taps of a row are
// read together, so that one point takes 16 loads, whatever its neighbours in a packet do.
#pragma once

#include "sdf/field_view.h"
#include "simd/packet.h"

namespace edgegrad::EDGEGRAD_ISA {

typedef float Taps __attribute__((vector_size(16)));

EG_INLINE Taps load_taps(const float* p) {
    Taps r;
    __builtin_memcpy(&r, p, sizeof r);
    return r;
}
EG_INLINE float sum_taps(Taps a) { return (a[0] + a[2]) + (a[1] + a[3]); }

// The basis functions of a cell at the fraction u, and their derivatives.
EG_INLINE Taps spline_weights(float u) {
    const float v = 1.0f - u, u2 = u * u, v2 = v * v;
    constexpr float k = 1.0f / 6.0f;
    return Taps{v2 * v * k, (4.0f - 3.0f * u2 * (1.0f + v)) * k, (4.0f - 3.0f * v2 * (1.0f + u)) * k,
                u2 * u * k};
}
EG_INLINE Taps spline_slopes(float u) {
    const float v = 1.0f - u;
    return Taps{-0.5f * v * v, 0.5f * u * (3.0f * u - 4.0f), 0.5f * v * (4.0f - 3.0f * v), 0.5f * u * u};
}
EG_INLINE Taps spline_bends(float u) { return Taps{1.0f - u, 3.0f * u - 2.0f, 1.0f - 3.0f * u, u}; }

struct FieldPoint {
    float value;
    float gradient[3];
};

EG_INLINE Taps larger_size(Taps a, Taps b) {
    const Taps size = b < 0.0f ? -b : b;
    return size > a ? size : a;
}

// The cell (i, j, k) at the fractions (u, v, w). `largest` becomes the size of the largest coefficient that
// it reads.
EG_INLINE FieldPoint spline(const FieldView& f, const int32_t (&cell)[3], const float (&at)[3],
                            float& largest) {
    // The weights of all axes together: those of tap k are w[k]
    constexpr float sixth = 1.0f / 6.0f;
    const Taps u{at[0], at[1], at[2], 0.0f}, v = 1.0f - u, u2 = u * u, v2 = v * v;
    const Taps w[4] = {v2 * v * sixth, (4.0f - 3.0f * u2 * (1.0f + v)) * sixth,
                       (4.0f - 3.0f * v2 * (1.0f + u)) * sixth, u2 * u * sixth};
    const Taps d[4] = {-0.5f * v2, 0.5f * u * (3.0f * u - 4.0f), 0.5f * v * (4.0f - 3.0f * v), 0.5f * u2};
    const Taps wz{w[0][2], w[1][2], w[2][2], w[3][2]}, dz{d[0][2], d[1][2], d[2][2], d[3][2]};
    const int64_t step = f.size[2], slab = step * f.size[1];
    const float* first = f.values + cell[0] * slab + cell[1] * step + cell[2];
    Taps value{}, along_x{}, along_y{}, most{};
    for (int i = 0; i < 4; ++i, first += slab) {
        const Taps r0 = load_taps(first), r1 = load_taps(first + step), r2 = load_taps(first + 2 * step),
                   r3 = load_taps(first + 3 * step);
        const Taps row = r0 * w[0][1] + r1 * w[1][1] + (r2 * w[2][1] + r3 * w[3][1]);
        value += row * w[i][0];
        along_x += row * d[i][0];
        along_y += (r0 * d[0][1] + r1 * d[1][1] + (r2 * d[2][1] + r3 * d[3][1])) * w[i][0];
        most = larger_size(larger_size(larger_size(larger_size(most, r0), r1), r2), r3);
    }
    const float one = most[0] > most[1] ? most[0] : most[1], other = most[2] > most[3] ? most[2] : most[3];
    largest = one > other ? one : other;
    return {sum_taps(value * wz), {sum_taps(along_x * wz), sum_taps(along_y * wz), sum_taps(value * dz)}};
}

EG_INLINE FieldPoint spline(const FieldView& f, const int32_t (&cell)[3], const float (&at)[3]) {
    float unused;
    return spline(f, cell, at, unused);
}

// The gradient, and the second derivatives xx, yy, zz, yz, xz, xy.
EG_INLINE void spline_derivatives(const FieldView& f, const int32_t (&cell)[3], const float (&at)[3],
                                  float (&g)[3], float (&h)[6]) {
    Taps w[3], d[3], b[3];
    for (int a = 0; a < 3; ++a)
        w[a] = spline_weights(at[a]), d[a] = spline_slopes(at[a]), b[a] = spline_bends(at[a]);
    const int64_t step = f.size[2], slab = step * f.size[1];
    const float* first = f.values + cell[0] * slab + cell[1] * step + cell[2];
    Taps value{}, x{}, y{}, xx{}, yy{}, xy{};
    for (int i = 0; i < 4; ++i, first += slab) {
        Taps row{}, turned{}, bent{};
        for (int j = 0; j < 4; ++j) {
            const Taps taps = load_taps(first + j * step);
            row += taps * w[1][j];
            turned += taps * d[1][j];
            bent += taps * b[1][j];
        }
        value += row * w[0][i], x += row * d[0][i], xx += row * b[0][i];
        y += turned * w[0][i], xy += turned * d[0][i];
        yy += bent * w[0][i];
    }
    g[0] = sum_taps(x * w[2]), g[1] = sum_taps(y * w[2]), g[2] = sum_taps(value * d[2]);
    h[0] = sum_taps(xx * w[2]), h[1] = sum_taps(yy * w[2]), h[2] = sum_taps(value * b[2]);
    h[3] = sum_taps(y * d[2]), h[4] = sum_taps(x * d[2]), h[5] = sum_taps(xy * w[2]);
}

// The cell of a grid point within the field's box, and the fraction within it.
EG_INLINE void find_cell(const FieldView& f, const double (&at)[3], int32_t (&cell)[3],
                         float (&fraction)[3]) {
    for (int a = 0; a < 3; ++a) {
        const int32_t last = f.cells(a) - 1;
        const int32_t c = at[a] > 0.0 ? static_cast<int32_t>(at[a] < last ? at[a] : last) : 0;
        cell[a] = c;
        fraction[a] = static_cast<float>(at[a] - c);
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
