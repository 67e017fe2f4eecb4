// Light beams, light on its way over perfect lobes, as kernels find them and read them
// (boundary/specular/light_beams.h).
#pragma once

#include <cstdint>

namespace edgegrad {

// Light from the point `light` to m_K = `last`, over further perfect lobes to m_1 = `first`, and to the
// surface `end`, for each sample. Distant light has a point far off. `weight` is 0 where there is none.
struct BeamPaths {
    float *light[3], *last[3], *first[3], *end[3];
    float *weight, *distance;  // distance: from the light to m_K, infinite if it is distant
};

constexpr int kBeamTargets = 16;

// Cells of space, each with points to which directions from there are aimed, since beams that pass through
// the cell come from these points or go to them.
struct BeamGridView {
    const int32_t* slot;  // by cell; -1: no beam passes; null: there are no beams
    // (slots, kBeamTargets, 4): the point, and the width of directions to it. The first width is 0 where no
    // directions are aimed.
    const float* targets;
    float low[3], inverse;  // of the grid; of a cell's side
    int32_t count[3];
};

}  // namespace edgegrad
