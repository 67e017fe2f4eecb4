// Paths of a task by number, and their random numbers.
#pragma once

#include "kernels.h"
#include "path/camera_rays.h"
#include "sampling/sobol.h"

namespace edgegrad::EDGEGRAD_ISA {

// Random stream of a pixel; the sampler scrambles and shuffles by it.
EG_INLINE UInt pixel_stream(uint32_t seed, UInt pixel) {
    return hash(pixel ^ splat(hash(seed + 0x9e3779b9u)));
}

// a / b for small non-negative a (< 2^20), exactly: vector units have no integer division.
EG_INLINE Int quotient(Int a, int b) { return to_int((to_float(a) + 0.5f) * (1.0f / static_cast<float>(b))); }

// Path p of a task is sample p % samples of pixel p / samples, counted from the task's first ones.
struct PathIndex {
    Int pixel;  // relative to the task's first pixel
    UInt sample;
    UInt stream;  // random numbers of the pixel
};

EG_INLINE PathIndex path_index(const ImageTask& task, Int path) {
    PathIndex index;
    index.pixel = quotient(path, task.samples);
    index.sample = bits(path - index.pixel * task.samples + task.first_sample);
    if (task.one_stream) {
        index.stream = splat(hash(task.seed));
        return index;
    }
    // A pixel's random numbers are those that it has in the full picture: a crop is a part of it.
    Int number = index.pixel + (task.first_pixel + task.skipped_all);
    if (task.skipped_row > 0)
        number = number + (quotient(index.pixel + task.column, task.width) + task.row) * task.skipped_row;
    index.stream = pixel_stream(task.seed, bits(number));
    return index;
}

}  // namespace edgegrad::EDGEGRAD_ISA
