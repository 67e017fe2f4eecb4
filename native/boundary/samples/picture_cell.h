// Places of samples that are spread over the picture.
#pragma once

#include "boundary/samples/segment_sampling.h"
#include "film/splat.h"
#include "tasks/boundary_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// Samples a place of the picture in the sample's cell. Returns the area of the picture that the sample
// represents.
EG_INLINE Float place_in_cell(const SceneView& scene, const BoundaryTask& task, const SegmentSample& p,
                              Float& sx, Float& sy) {
    const CameraView& c = scene.camera;
    const bool turn = c.kind == kEquirectangular && __builtin_fabsf(c.panorama[1] - c.panorama[0]) > 6.2831f;
    const float margin = filter_margin(c), left = turn ? 0.0f : margin;
    const float n = static_cast<float>(task.direction_cells);
    const float width = (static_cast<float>(c.width) + 2.0f * left) / n;
    const float height = (static_cast<float>(c.height) + 2.0f * margin) / n;
    const Int row = quotient(p.cell, task.direction_cells), column = p.cell - row * task.direction_cells;
    const auto [u, v] = sobol_pair(p.random, kPairPixel);
    sx = (to_float(column) + u) * width - left;
    sy = (to_float(row) + v) * height - margin;
    return width * height / p.density;
}

}  // namespace edgegrad::EDGEGRAD_ISA
