// Light from the environment: radiance by direction, and samples of it where it is an image.
//
// A constant environment isn't sampled: directions of the BSDF alone are best. An image is sampled in
// proportion to what its cells are brighter than the mean, uniformly in solid angle within a cell; the rest
// is left to the BSDF's samples. So the two must always be combined by multiple importance sampling.
#pragma once

#include "scene/view.h"
#include "simd/elementary.h"
#include "simd/vector.h"

namespace edgegrad::EDGEGRAD_ISA {

constexpr float kHalfInvPi = 0.159154943f;

EG_INLINE Vec3 rotated(const float* m, Vec3 v) {
    return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z,
            m[6] * v.x + m[7] * v.y + m[8] * v.z};
}
EG_INLINE Vec3 rotated_back(const float* m, Vec3 v) {
    return {m[0] * v.x + m[3] * v.y + m[6] * v.z, m[1] * v.x + m[4] * v.y + m[7] * v.z,
            m[2] * v.x + m[5] * v.y + m[8] * v.z};
}

// Place in the image, u to the right and v from the top, both in [0, 1].
EG_INLINE void environment_place(const SceneView& scene, Vec3 w, Float& u, Float& v) {
    const Vec3 d = rotated(scene.environment_rotation, w);
    u = 0.5f - atan2(d.y, d.x) * kHalfInvPi;
    // atan2 has digits at the poles where asin hasn't.
    v = atan2(sqrt(d.x * d.x + d.y * d.y), d.z) * (2.0f * kHalfInvPi);
}

// Bilinear; columns and rows follow each other over the edges (Cycles' repeat).
EG_INLINE Vec3 filter_environment(const EnvironmentView& map, Float u, Float v) {
    const Float x = u * static_cast<float>(map.width) - 0.5f, y = v * static_cast<float>(map.height) - 0.5f;
    const Float left = floor(x), top = floor(y);
    const Float fx = x - left, fy = y - top;
    Int x0 = to_int(left), y0 = to_int(top);
    x0 = select(x0 < 0, x0 + map.width, x0);
    y0 = select(y0 < 0, y0 + map.height, y0);
    x0 = select(x0 >= map.width, splat(0), x0);
    y0 = select(y0 >= map.height, splat(0), y0);
    const Int x1 = select(x0 + 1 >= map.width, splat(0), x0 + 1);
    const Int y1 = select(y0 + 1 >= map.height, splat(0), y0 + 1);
    const auto pixel = [&](Int column, Int row) {
        Vec3 p;
        for (int i = 0; i < W; ++i) {
            const float* q = map.pixels + 3 * (static_cast<int64_t>(row[i]) * map.width + column[i]);
            p.x[i] = q[0], p.y[i] = q[1], p.z[i] = q[2];
        }
        return p;
    };
    const Vec3 upper = pixel(x0, y0) * (1.0f - fx) + pixel(x1, y0) * fx;
    const Vec3 lower = pixel(x0, y1) * (1.0f - fx) + pixel(x1, y1) * fx;
    return upper * (1.0f - fy) + lower * fy;
}

// Radiance that comes from the direction w to rays of a kind that see the environment.
EG_INLINE Vec3 environment_radiance(const SceneView& scene, Vec3 w) {
    const Vec3 color = splat3(scene.environment);
    if (!scene.sky.pixels) return color;
    Float u, v;
    environment_place(scene, w, u, v);
    return color * filter_environment(scene.sky, u, v);
}

struct EnvironmentSample {
    Vec3 w;  // unit, towards the environment
    Vec3 radiance;
    Float pdf;  // per solid angle
};

// Density of the cell (column, row): its probability by its solid angle.
EG_INLINE Float cell_density(const EnvironmentView& map, Int column, Int row) {
    Float density;
    const float angle = 6.28318531f / static_cast<float>(map.columns);
    for (int i = 0; i < W; ++i) {
        const int r = row[i];
        const float* cdf = map.columns_cdf + static_cast<int64_t>(r) * (map.columns + 1) + column[i];
        const float probability = (cdf[1] - cdf[0]) * (map.rows_cdf[r + 1] - map.rows_cdf[r]);
        density[i] = probability / (angle * (map.sines[r] - map.sines[r + 1]));
    }
    return density;
}

EG_INLINE EnvironmentSample sample_environment(const SceneView& scene, Mask active, Float u, Float v) {
    const EnvironmentView& map = scene.sky;
    EnvironmentSample s;
    Int row, column;
    Float within_row, within_column, upper, lower;
    for (int i = 0; i < W; ++i) {
        // Last entry not above the number.
        const auto search = [](const float* cdf, int count, float x) {
            int low = 0, high = count;
            while (high - low > 1) {
                const int mid = (low + high) >> 1;
                (cdf[mid] <= x ? low : high) = mid;
            }
            return low;
        };
        const auto place = [](const float* cdf, float x) {
            const float width = cdf[1] - cdf[0];
            return width > 0.0f ? (x - cdf[0]) / width : 0.5f;
        };
        row[i] = active[i] ? search(map.rows_cdf, map.rows, v[i]) : 0;
        const float* cdf = map.columns_cdf + static_cast<int64_t>(row[i]) * (map.columns + 1);
        column[i] = active[i] ? search(cdf, map.columns, u[i]) : 0;
        within_row[i] = place(map.rows_cdf + row[i], v[i]);
        within_column[i] = place(cdf + column[i], u[i]);
        upper[i] = map.sines[row[i]];
        lower[i] = map.sines[row[i] + 1];
    }
    const Float z = upper + (lower - upper) * within_row;
    const Float horizontal = sqrt(max((1.0f - z) * (1.0f + z), 0.0f));
    const Float place_u = (to_float(column) + within_column) * (1.0f / static_cast<float>(map.columns));
    Float sine, cosine;
    const Float turn = 0.5f - place_u;
    sincos_turn(select(turn < 0.0f, turn + 1.0f, turn), sine, cosine);
    s.w = rotated_back(scene.environment_rotation, {horizontal * cosine, horizontal * sine, z});
    s.pdf = cell_density(map, column, row);
    s.radiance = environment_radiance(scene, s.w);
    return s;
}

// Density with which `sample_environment` finds the direction w; 0 where there is no image.
EG_INLINE Float environment_pdf(const SceneView& scene, Vec3 w) {
    const EnvironmentView& map = scene.sky;
    if (!map.sampled) return splat(0.0f);
    Float u, v;
    environment_place(scene, w, u, v);
    Int column = to_int(u * static_cast<float>(map.columns)), row = to_int(v * static_cast<float>(map.rows));
    column = select(column >= map.columns, splat(map.columns - 1), select(column < 0, splat(0), column));
    row = select(row >= map.rows, splat(map.rows - 1), select(row < 0, splat(0), row));
    return cell_density(map, column, row);
}

}  // namespace edgegrad::EDGEGRAD_ISA
