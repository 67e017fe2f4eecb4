// The task of the kernels for pictures.
#pragma once

#include <cstdint>

namespace edgegrad {

// Largest numbers of scattering events by kind. A ray after the last event still finds light, but is not
// scattered again.
struct BounceLimits {
    int32_t diffuse = 255, glossy = 255, transmission = 255, transparent = 255, medium = 255;
    // Of all events but transmission and the first glossy one, from this number on; 255: no limit (Cycles'
    // Fast GI Approximation).
    int32_t ambient = 255;
};

// A run of pixels with some of their samples: pixel_count * samples <= kBlockPaths.
struct ImageTask {
    int32_t first_pixel, pixel_count;
    int32_t first_sample, samples;  // sample indices within each pixel
    int32_t max_depth;
    uint32_t seed;
    float weight;  // 1 / samples per pixel
    int32_t skipped_row,
        skipped_all;      // pixels of the full picture left out per row, and before the window's first
    int32_t row, column;  // of the first pixel in the window
    int32_t width;        // of the window
    BounceLimits limits;
    bool caustics_alone;  // only light that reaches a blurred path by a perfect lobe (path/path_queue.h)
                          // counts
    bool one_stream;      // all pixels use the random numbers of the first, for the two sides of edges
    // If not negative, close pixels share a sequence (path/stream.h), of whose numbers each pixel uses this
    // many bits.
    int32_t sample_bits = -1;
    bool mirrored_pairs = false;  // samples 2 k and 2 k + 1 of a pixel mirror each other (path/stream.h)

    int64_t pixel_of(int32_t path) const { return first_pixel + path / samples; }
};

}  // namespace edgegrad
