// The numbers of one ray or of a packet of rays, for code that is the same for both (sdf/trace.cpp).
#pragma once

#include "simd/lanes.h"

namespace edgegrad::EDGEGRAD_ISA {

// Choices by lane are written `which ? a : b`. `Part` are some of the lanes in double precision, as many as a
// register holds.
struct OneRay {
    static constexpr int kCount = 1, kParts = 1;
    using Real = float;
    using Index = int32_t;
    using Which = bool;
    using Part = double;

    static Part widen(const float* p) { return static_cast<double>(*p); }
    static void narrow(Part a, float* p) { *p = static_cast<float>(a); }
    static Which none() { return false; }
    static Which negated(Which a) { return !a; }
    static uint32_t bits(Which a) { return a ? 1u : 0u; }
    static void only(Which& a, uint32_t lanes) { a = a && (lanes & 1u) != 0; }
    static Index to_index(Real a, int least, int most) {
        const auto low = static_cast<float>(least), high = static_cast<float>(most);
        const float up = a > low ? a : low;
        return static_cast<int32_t>(up < high ? up : high);
    }
    static Real to_real(Index a) { return static_cast<float>(a); }
    static Real root(Real a) { return __builtin_sqrtf(a); }
};

#if EDGEGRAD_WIDTH > 1
struct RayPacket {
    static constexpr int kCount = W, kParts = 2;
    using Real = Float;
    using Index = Int;
    using Which = Mask;
    typedef double Part __attribute__((vector_size(4 * EDGEGRAD_WIDTH)));
    typedef float Narrow __attribute__((vector_size(2 * EDGEGRAD_WIDTH)));

    static Part widen(const float* p) {
        Narrow a;
        __builtin_memcpy(&a, p, sizeof a);
        return __builtin_convertvector(a, Part);
    }
    static void narrow(Part a, float* p) {
        const Narrow b = __builtin_convertvector(a, Narrow);
        __builtin_memcpy(p, &b, sizeof b);
    }
    static Which none() { return Mask{}; }
    static Which negated(Which a) { return ~a; }
    static uint32_t bits(Which a) { return lane_bits(a); }
    static void only(Which& a, uint32_t lanes) {
        a = a & ((splat(static_cast<int>(lanes)) >> lane_index() & 1) != 0);
    }
    static Index to_index(Real a, int least, int most) { return EDGEGRAD_ISA::to_index(a, least, most); }
    static Real to_real(Index a) { return to_float(a); }
    static Real root(Real a) { return sqrt(a); }
};
#endif

template <typename T>
EG_INLINE T larger(T a, T b) {
    return a > b ? a : b;
}
template <typename T>
EG_INLINE T smaller(T a, T b) {
    return a < b ? a : b;
}
template <typename T>
EG_INLINE T size_of(T a) {
    return a < 0 ? -a : a;
}

}  // namespace edgegrad::EDGEGRAD_ISA
