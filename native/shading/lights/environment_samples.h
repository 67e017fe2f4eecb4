// Sampling of the environment's image.
//
// A constant environment is not sampled, because BSDF samples find it best. For an image, cells are sampled
// in proportion to the amount by which they exceed the mean, uniformly in solid angle within a cell. The rest
// is left to BSDF samples, so that both must be combined by multiple importance sampling.
#pragma once

#include "shading/lights/environment.h"

namespace edgegrad::EDGEGRAD_ISA {

struct EnvironmentSample {
    Vec3 w;  // unit, towards the environment
    Vec3 radiance;
    Float pdf;  // per solid angle
};

// Density of the cell (column, row): its probability divided by its solid angle.
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
    const EnvironmentView& map = scene.environment_image;
    EnvironmentSample s;
    Int row, column;
    Float within_row, within_column, upper, lower;
    for (int i = 0; i < W; ++i) {
        // Index of the last entry that is not above x.
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

// Density of `sample_environment` in the direction w; 0 without an image.
EG_INLINE Float environment_pdf(const SceneView& scene, Vec3 w) {
    const EnvironmentView& map = scene.environment_image;
    if (!map.sampled) return splat(0.0f);
    Float u, v;
    environment_place(scene, w, u, v);
    const Int column = to_index(u * static_cast<float>(map.columns), 0, map.columns - 1);
    const Int row = to_index(v * static_cast<float>(map.rows), 0, map.rows - 1);
    return cell_density(map, column, row);
}

}  // namespace edgegrad::EDGEGRAD_ISA
