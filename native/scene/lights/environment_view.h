// What kernels read of an environment's image.
#pragma once

#include <cstdint>

namespace edgegrad {

struct EnvironmentView {
    const float* pixels;  // (height, width, 3), row 0 on top; null: no image
    int32_t width, height;
    bool sampled;  // every ray that scatters sees it
    // Cells of the sampling grid, uniform in longitude and latitude; row 0 on top.
    int32_t columns, rows;
    const float* sines;        // (rows + 1) of the rows' upper and lower latitudes, from 1 to -1
    const float* rows_cdf;     // (rows + 1)
    const float* columns_cdf;  // (rows, columns + 1)
};

}  // namespace edgegrad
