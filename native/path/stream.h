// Indices of a task's paths, and their random numbers.
#pragma once

#include "path/camera_rays.h"
#include "sampling/sobol.h"
#include "sampling/z_order.h"
#include "tasks/image_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// Random stream of a pixel, which seeds the sampler's scrambling and shuffling.
EG_INLINE UInt pixel_stream(uint32_t seed, UInt pixel) {
    return hash(pixel ^ splat(hash(seed + 0x9e3779b9u)));
}

// a / b for small non-negative a (< 2^20), exactly. Vector units have no integer division.
EG_INLINE Int quotient(Int a, int b) { return to_int((to_float(a) + 0.5f) * (1.0f / static_cast<float>(b))); }

// Path p of a task is sample p % samples of pixel p / samples, counted from the task's first ones.
//
// Mirrored pairs (Zhang et al. 2021, "Antithetic Sampling for Monte Carlo Differentiable Rendering"): samples
// 2 k and 2 k + 1 of a pixel take the same path up to a surface with sharp lobes (path/lights/lobe_light.h),
// where the second takes the direction on the other side of the lobe's middle. The derivative of a sharp lobe
// is odd about its middle, so that in the sum of both only differences of the light count (derivations, A8).
struct PathIndex {
    Int pixel;  // relative to the task's first pixel
    UInt sample;
    UInt stream;               // the pixel's random stream
    UInt own{};                // a sample of no pair, for light that the path does not depend on
    Mask mirrored = splat(0);  // the second sample of a pair
};

// Lets all pixels of a square share one Sobol' sequence, ordered along a Z-order curve (Ahmed and Wonka 2020,
// "Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error via Hierarchical Ordering of Pixels").
// Every aligned block of 2^k points of a scrambled Sobol' sequence is well distributed. So each pixel's
// samples are as good as before, and those of neighbouring pixels complement each other. The variance of one
// pixel is unchanged; the variance of sums over pixels, such as gradients, decreases.
// `number` has the `sample_bits` lowest bits of a number in the sequence.
EG_INLINE UInt shared_number(UInt number, UInt place, int32_t sample_bits) {
    return number + (place << sample_bits);
}

EG_INLINE void share_numbers(const ImageTask& task, PathIndex& index) {
    const int full = task.width + task.skipped_row;
    const Int rows = quotient(index.pixel + task.column, task.width);
    const UInt row = bits(rows + (task.row + task.skipped_all / full));
    const UInt column = bits(index.pixel - rows * task.width + (task.column + task.skipped_all % full));
    const int bits_a_side = (32 - task.sample_bits) / 2 < 8 ? (32 - task.sample_bits) / 2 : 8;
    const uint32_t within = (1u << bits_a_side) - 1u;
    const UInt place = spread_bits(column & within) | (spread_bits(row & within) << 1);
    index.sample = shared_number(index.sample, place, task.sample_bits - (task.mirrored_pairs ? 1 : 0));
    index.own = shared_number(index.own, place, task.sample_bits);
    index.stream = pixel_stream(task.seed, ((row >> bits_a_side) << 16) | (column >> bits_a_side));
}

EG_INLINE PathIndex path_index(const ImageTask& task, Int path) {
    PathIndex index;
    index.pixel = quotient(path, task.samples);
    index.sample = index.own = bits(path - index.pixel * task.samples + task.first_sample);
    if (task.mirrored_pairs) {
        index.mirrored = bits(index.own & 1u) != 0;
        index.sample = index.own >> 1;
    }
    if (task.one_stream) {
        index.stream = splat(hash(task.seed));
        return index;
    }
    if (task.sample_bits >= 0) {
        share_numbers(task, index);
        return index;
    }
    // A pixel of a crop has the random numbers that it has in the full picture.
    Int number = index.pixel + (task.first_pixel + task.skipped_all);
    if (task.skipped_row > 0)
        number = number + (quotient(index.pixel + task.column, task.width) + task.row) * task.skipped_row;
    index.stream = pixel_stream(task.seed, bits(number));
    return index;
}

}  // namespace edgegrad::EDGEGRAD_ISA
