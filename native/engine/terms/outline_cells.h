// Cells of the picture for samples in bands about the outlines of distance fields.
#pragma once

#include "boundary/curves/candidates.h"
#include "boundary/curves/intersections.h"

namespace edgegrad {

// About `requested` cells over the whole picture as candidates on one line, number `line`. Cells within
// `pixels` of an outline have most of the weight. Empty if no outline is in reach of the picture.
Candidates outline_cells(const CameraView& camera, const Intersections& outlines, int32_t line, double pixels,
                         double requested);

}  // namespace edgegrad
