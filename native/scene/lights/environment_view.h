// An environment's image as kernels read it.
#pragma once

#include <cstdint>

namespace edgegrad {

struct EnvironmentView {
    const float* pixels;  // (height, width, 3), row 0 on top; null: no image
    int32_t width, height;
    bool sampled;  // all scattered rays can see it
    // Cells of the sampling grid, uniform in longitude and latitude; row 0 on top.
    int32_t columns, rows;
    const float* sines;        // (rows + 1) sines of the latitudes between the rows, from 1 to -1
    const float* rows_cdf;     // (rows + 1)
    const float* columns_cdf;  // (rows, columns + 1)
};

}  // namespace edgegrad
