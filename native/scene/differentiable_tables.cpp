#include "scene/differentiable_tables.h"

#include <stdexcept>

namespace edgegrad {

void DifferentiableTables::add(const float* begin, size_t size, size_t first, size_t last, int32_t width,
                               uint64_t columns, double* gradient, const double* tangent) {
    if (first >= last) return;
    if (count == kMost || last > size || size > size_t{0x7fffffff})
        throw std::logic_error("a differentiable table has a span outside of it, or there are too many");
    table[count++] = {begin, begin + size, begin + first, begin + last, width, columns, gradient, tangent};
}

}  // namespace edgegrad
