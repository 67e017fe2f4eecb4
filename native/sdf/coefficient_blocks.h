// Extremes of a field's coefficients in blocks of 8^3: one pass over the coefficients proves most of the
// bricks and cells empty, of which each coefficient has several.
#pragma once

#include <cstdint>
#include <vector>

#include "sdf/field_view.h"

namespace edgegrad {

// Along each axis a brick of 8 cells reads the coefficients of its own block and the first three of the next.
constexpr int32_t kBlockSide = 8;

class CoefficientBlocks {
 public:
    // The blocks [from, to) along each axis.
    CoefficientBlocks(const FieldView& f, const int32_t (&from)[3], const int32_t (&to)[3], int threads);

    // Whether all coefficients that the brick of a number reads have one sign, which is then proven. The
    // brick and its next neighbours must be among the blocks as far as the field has them.
    bool one_sign(const int32_t (&brick)[3]) const;

    static int32_t count(const FieldView& f, int axis) {
        return (f.size[axis] + kBlockSide - 1) / kBlockSide;
    }

 private:
    struct Extremes {
        float low, high;
    };
    void read(const FieldView& f, int32_t block);

    int32_t from_[3], size_[3];  // the first block, and the numbers of blocks
    std::vector<Extremes> blocks_;
};

}  // namespace edgegrad
