// The tables of floats that derivatives are taken of. Whatever kernels on taped numbers read from their spans
// has a derivative; everything else is constant.
#pragma once

#include <cstddef>
#include <cstdint>

namespace edgegrad {

struct DifferentiableTable {
    const float *begin, *end;   // the whole table, by which its reads are known
    const float *first, *last;  // the span of it that is asked for
    int32_t width;              // of the table's rows, if only some columns (bits) are asked for; else 1
    uint64_t columns;
    double* gradient = nullptr;       // of the span: backward sweeps add to it
    const double* tangent = nullptr;  // of the span: forward sweeps start from it
};

struct DifferentiableTables {
    static constexpr int kMost = 20;
    DifferentiableTable table[kMost];
    int count = 0;

    // The floats [first, last) of a table of `size` floats, with their gradient or tangent; empty spans and
    // tables are left out. Of rows of `width` floats only some columns count, if it isn't 1. Tables must not
    // overlap and have less than 2^31 floats; each may be added once.
    void add(const float* table, size_t size, size_t first, size_t last, int32_t width, uint64_t columns,
             double* gradient, const double* tangent);
};

}  // namespace edgegrad
