// The tables of floats whose derivatives are requested. What kernels on taped numbers read from the requested
// spans has derivatives; everything else is constant.
#pragma once

#include <cstddef>
#include <cstdint>

#include "sdf/field_derivatives.h"

namespace edgegrad {

struct DifferentiableTable {
    const float *begin, *end;   // the whole table; its addresses identify reads
    const float *first, *last;  // the requested span
    int32_t width;              // floats per row, if only some columns (bits) are requested; else 1
    uint64_t columns;
    double* gradient = nullptr;       // of the span; backward sweeps add to it
    const double* tangent = nullptr;  // of the span; forward sweeps start from it
};

struct DifferentiableTables {
    static constexpr int kMost = 20;
    DifferentiableTable table[kMost];
    int count = 0;
    FieldDerivatives fields;

    // Adds the floats [first, last) of a table of `size` floats, with their gradient or tangent. Empty spans
    // and tables are skipped. If `width` is not 1, rows have `width` floats, of which only `columns` have
    // derivatives. Tables must not overlap and must have less than 2^31 floats. Each table may be added once.
    void add(const float* table, size_t size, size_t first, size_t last, int32_t width, uint64_t columns,
             double* gradient, const double* tangent);
};

}  // namespace edgegrad
