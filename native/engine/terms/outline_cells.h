// Cells and pixels of the picture about the outlines of distance fields.
#pragma once

#include "boundary/curves/candidates.h"
#include "boundary/curves/intersections.h"

namespace edgegrad {

// About `requested` cells over the whole picture as candidates on one line, number `line`. Cells within
// `pixels` of an outline have most of the weight. Empty if no outline is in reach of the picture.
Candidates outline_cells(const CameraView& camera, const Intersections& outlines, int32_t line, double pixels,
                         double requested);

// Marks the pixels, row by row, whose filters reach an outline.
std::vector<uint8_t> outline_pixels(const CameraView& camera, const Intersections& outlines);

}  // namespace edgegrad
