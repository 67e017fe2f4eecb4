// A place in a field's box as the bits of two floats (sdf/trace.h).
#pragma once

#include "sdf/field_view.h"
#include "simd/packet.h"

namespace edgegrad::EDGEGRAD_ISA {

constexpr int kPlaceBits = 21;
constexpr double kPlaceSteps = (1 << kPlaceBits) - 1;

EG_INLINE void encode_place(const FieldView& f, const double (&grid)[3], uint32_t (&code)[2]) {
    uint64_t bits = 0;
    for (int a = 0; a < 3; ++a) {
        const double part = grid[a] / f.cells(a);
        const double step = (part > 0.0 ? (part < 1.0 ? part : 1.0) : 0.0) * kPlaceSteps + 0.5;
        bits = bits << kPlaceBits | static_cast<uint64_t>(step);
    }
    code[0] = static_cast<uint32_t>(bits);
    code[1] = static_cast<uint32_t>(bits >> 32);
}

EG_INLINE void decode_place(const FieldView& f, const uint32_t (&code)[2], double (&grid)[3]) {
    uint64_t bits = static_cast<uint64_t>(code[1]) << 32 | code[0];
    for (int a = 2; a >= 0; --a) {
        grid[a] = static_cast<double>(bits & ((1u << kPlaceBits) - 1)) * (f.cells(a) * (1.0 / kPlaceSteps));
        bits >>= kPlaceBits;
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
