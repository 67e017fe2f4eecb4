// How many samples and cells the boundary terms have.
#pragma once

#include <algorithm>
#include <cstdint>

namespace edgegrad {

// Number of cells with learned sample weights: per sample, and at most.
inline double learned_cells(double samples) { return std::min(0.06 * samples, 262'144.0); }

// Fewest samples of the primary term per pixel and sample of the picture: in general, and for so many edges
// that samples hit them at random. Along few edges, the error of systematic samples falls faster than that of
// random ones.
constexpr double kLeastPrimary = 0.15, kLeastScattered = 0.09;

// The fraction of the samples that is taken if there are fewer samples than segments (for directions towards
// light: fewer than a few per segment). Samples then hit segments at random, and seconds x variance hardly
// depends on their number. With few segments it falls with the number of samples.
constexpr double kSamplesTowardsLight = 32.0, kLeastPart = 0.25;
inline double scattered(int64_t segments, double each, double samples) {
    return std::clamp(samples / (each * static_cast<double>(std::max<int64_t>(1, segments))), kLeastPart,
                      1.0);
}

}  // namespace edgegrad
