// Candidates cut into the cells over which samples are stratified: segments of edges, each with cells of
// directions, or cells of the picture.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "boundary/curves/candidates.h"

namespace edgegrad {

// The fraction of samples for receivers that the camera sees directly, or (`chained`) through other surfaces.
// Without `chains` there are none of the latter.
constexpr double kChainedShare = 0.4;
constexpr double share_of_mass(bool chains, bool chained) {
    return !chains ? 1.0 : chained ? kChainedShare : 1.0 - kChainedShare;
}

// Cuts the candidates into segments at the positions borders(k, u) of candidate k, each with
// `direction_cells`^2 cells of directions. `chains` adds segments whose receiver the camera sees through
// other surfaces.
using Borders = std::function<void(size_t k, std::vector<float>& u)>;
Candidates cut(const Candidates& edges, int32_t direction_cells, bool chains, const Borders& borders);

// Candidates of samples that start at the camera: about `requested` cells of the picture, stored in place of
// the direction cells of one dummy edge. `chains` adds paths that scatter at least once before they pass an
// edge.
Candidates whole_picture();
Candidates over_picture(double requested, bool chains);

// The candidate edges with cells for light between surfaces: about `requested` pairs of a segment and a
// direction cell. `chains` adds segments whose receiver the camera sees through other surfaces.
Candidates over_directions(const Candidates& edges, double requested, bool chains);

}  // namespace edgegrad
