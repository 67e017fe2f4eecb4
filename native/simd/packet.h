// Packets of W floats, integers and masks. Kernels read like scalar code, but each value has W lanes.
//
// The packets are vector types of GCC and Clang: arithmetic, comparisons (giving a Mask: -1 true, 0 false per
// lane) and `select` in place of `if`. W is EDGEGRAD_WIDTH. Each instruction set compiles this header into
// its own namespace (EDGEGRAD_ISA), because the linker merges functions of one name from several translation
// units, whatever instructions they use. For the same reason kernels call nothing from namespace std.
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace edgegrad::EDGEGRAD_ISA {

constexpr int W = EDGEGRAD_WIDTH;

typedef float Float __attribute__((vector_size(4 * EDGEGRAD_WIDTH)));
typedef int32_t Int __attribute__((vector_size(4 * EDGEGRAD_WIDTH)));
typedef uint32_t UInt __attribute__((vector_size(4 * EDGEGRAD_WIDTH)));
using Mask = Int;

// Passing a packet through memory costs more than arithmetic on it. Therefore everything is inlined by force,
// except in kernels where this gains nothing (CMakeLists.txt), and in sanitized builds, where compilation
// would take far too long.
#ifdef EDGEGRAD_INLINE_FREELY
#define EG_INLINE inline
#define EG_INLINE_LAMBDA
#else
#define EG_INLINE inline __attribute__((always_inline))
#define EG_INLINE_LAMBDA __attribute__((always_inline))
#endif

// Large functions with few call sites are not inlined. Inlining them would slow compilation down without a
// gain.
#define EG_NOINLINE __attribute__((noinline))
#define EG_OUTLINE static EG_NOINLINE

EG_INLINE Float splat(float s) { return Float{} + s; }
EG_INLINE Int splat(int s) { return Int{} + s; }
EG_INLINE UInt splat(uint32_t s) { return UInt{} + s; }
// The number of an enumerator.
template <typename E>
    requires std::is_enum_v<E>
EG_INLINE Int splat(E e) {
    return splat(static_cast<int>(e));
}

EG_INLINE Int lane_index() {
    Int r;
    for (int i = 0; i < W; ++i) r[i] = i;
    return r;
}

EG_INLINE Float to_float(Int a) { return __builtin_convertvector(a, Float); }
EG_INLINE Float to_float(UInt a) { return __builtin_convertvector(a, Float); }
EG_INLINE Int to_int(Float a) { return __builtin_convertvector(a, Int); }  // rounds towards zero
EG_INLINE UInt bits(Int a) { return reinterpret_cast<UInt>(a); }
EG_INLINE Int bits(UInt a) { return reinterpret_cast<Int>(a); }
EG_INLINE UInt float_bits(Float a) { return reinterpret_cast<UInt>(a); }

// GCC 12 mishandles one-lane selections that are written like those of wider packets.
template <typename T>
EG_INLINE T select_packet(Mask m, T a, T b) {
    if constexpr (W == 1)
        return m[0] ? a : b;
    else
        return m ? a : b;
}
EG_INLINE Float select(Mask m, Float a, Float b) { return select_packet(m, a, b); }
EG_INLINE Int select(Mask m, Int a, Int b) { return select_packet(m, a, b); }
// On Windows the results of comparisons are vectors of long, which is a type of its own there.
template <typename T>
    requires(std::is_same_v<T, decltype(Float{} < Float{})> && !std::is_same_v<T, Int>)
EG_INLINE Int select(Mask m, T a, T b) {
    return select_packet(m, static_cast<Mask>(a), static_cast<Mask>(b));
}
EG_INLINE Float select(Mask m, Float a, float b) { return select_packet(m, a, splat(b)); }

EG_INLINE Float min(Float a, Float b) { return select(a < b, a, b); }
EG_INLINE Float max(Float a, Float b) { return select(a > b, a, b); }
EG_INLINE Float max(Float a, float b) { return max(a, splat(b)); }
EG_INLINE Float abs(Float a) { return select(a < 0.0f, -a, a); }

// The integer within [least, most] (both below 2^24 in magnitude) to which a is rounded, towards zero;
// `least` for NaN. For indices: converting a float that no integer can represent is undefined, and NaN passes
// comparisons of the result.
EG_INLINE Int to_index(Float a, int least, int most) {
    return to_int(min(max(a, static_cast<float>(least)), splat(static_cast<float>(most))));
}

EG_INLINE Float sqrt(Float a) {
    Float r;
    for (int i = 0; i < W; ++i) r[i] = __builtin_sqrtf(a[i]);
    return r;
}

// Lanes whose derivative is requested (adjoint/number.h); none for raw packets.
EG_INLINE Mask has_derivative(Float) { return Mask{}; }

EG_INLINE bool any(Mask m) {
#if defined(__AVX512F__) && EDGEGRAD_WIDTH == 16
    return _mm512_test_epi32_mask((__m512i)m, (__m512i)m) != 0;
#elif defined(__AVX__) && EDGEGRAD_WIDTH == 8
    return _mm256_movemask_ps((__m256)m) != 0;
#elif defined(__SSE2__) && EDGEGRAD_WIDTH == 4
    return _mm_movemask_ps((__m128)m) != 0;
#else
    int r = 0;
    for (int i = 0; i < W; ++i) r |= m[i];
    return r != 0;
#endif
}

EG_INLINE Mask first_lanes(int n) { return lane_index() < splat(n); }

EG_INLINE Float load(const float* p) {
    Float r;
    __builtin_memcpy(&r, p, sizeof r);
    return r;
}
EG_INLINE Int load(const int32_t* p) {
    Int r;
    __builtin_memcpy(&r, p, sizeof r);
    return r;
}
EG_INLINE void store(float* p, Float a) { __builtin_memcpy(p, &a, sizeof a); }
EG_INLINE void store(int32_t* p, Int a) { __builtin_memcpy(p, &a, sizeof a); }

// Inactive lanes must hold a valid index, such as 0.
#if defined(__AVX512F__) && EDGEGRAD_WIDTH == 16
// Faster than separate loads. The masked intrinsics are used because GCC 12 reports uninitialised operands
// for the others.
constexpr __mmask16 kAllLanes = 0xffff;
EG_INLINE Float gather(const float* base, Int index) {
    return (Float)_mm512_mask_i32gather_ps(_mm512_setzero_ps(), kAllLanes, (__m512i)index, base, 4);
}
EG_INLINE Int gather(const int32_t* base, Int index) {
    return (Int)_mm512_mask_i32gather_epi32(_mm512_setzero_si512(), kAllLanes, (__m512i)index, base, 4);
}
#else
EG_INLINE Float gather(const float* base, Int index) {
    Float r;
    for (int i = 0; i < W; ++i) r[i] = base[index[i]];
    return r;
}
EG_INLINE Int gather(const int32_t* base, Int index) {
    Int r;
    for (int i = 0; i < W; ++i) r[i] = base[index[i]];
    return r;
}
#endif
// For unsigned numbers below 2^31.
EG_INLINE Int gather(const uint32_t* base, Int index) {
    return gather(reinterpret_cast<const int32_t*>(base), index);
}

// Writes the values of the lanes of a mask to distinct positions.
template <typename V, typename T>
EG_INLINE void scatter(T* base, Int index, Mask m, V a) {
#if defined(__AVX512F__) && EDGEGRAD_WIDTH == 16
    _mm512_mask_i32scatter_epi32(base, _mm512_test_epi32_mask((__m512i)m, (__m512i)m), (__m512i)index,
                                 (__m512i)a, 4);
#else
    for (int i = 0; i < W; ++i)
        if (m[i]) base[index[i]] = a[i];
#endif
}

// Copies one lane of a struct of packets to a lane of another one.
template <typename T>
EG_INLINE void move_lane(T& to, int lane, const T& from, int other) {
    static_assert(sizeof(T) % sizeof(Float) == 0);
    char* const out = reinterpret_cast<char*>(&to) + 4 * lane;
    const char* const in = reinterpret_cast<const char*>(&from) + 4 * other;
    for (size_t k = 0; k < sizeof(T); k += sizeof(Float)) __builtin_memcpy(out + k, in + k, 4);
}

// The same float for all lanes, read from a table. Unlike for a splat, adjoint/number.h can give it a
// derivative.
EG_INLINE Float broadcast(const float* p) { return splat(*p); }

// The rows of the lanes: a packet, or an array in memory. Numbers that were just read lane by lane stay in
// memory, because assembling a packet and taking it apart again is slow.
typedef int32_t Rows[W];
EG_INLINE Int packet(Int rows) { return rows; }
EG_INLINE Int packet(const Rows& rows) { return load(rows); }

#if defined(__SSE4_2__) && (EDGEGRAD_WIDTH == 4 || EDGEGRAD_WIDTH == 8)
// Reads two to four floats of each row, from column k on, and transposes them.
EG_INLINE void gather_columns(const float* const (&rows)[W], int k, int count, Float* out) {
    // Memory behind a row may not belong to the table.
    const auto some = [&](int i) {
        const float* p = rows[i] + k;
        if (count - k >= 4) return _mm_loadu_ps(p);
        const __m128 two = _mm_loadl_pi(_mm_setzero_ps(), reinterpret_cast<const __m64*>(p));
        return count - k == 2 ? two : _mm_movelh_ps(two, _mm_load_ss(p + 2));
    };
#if EDGEGRAD_WIDTH == 8
    const auto row = [&](int i) { return _mm256_set_m128(some(i + 4), some(i)); };
    const __m256 a = row(0), b = row(1), c = row(2), d = row(3);
    const __m256 low_ab = _mm256_unpacklo_ps(a, b), low_cd = _mm256_unpacklo_ps(c, d);
    const __m256 high_ab = _mm256_unpackhi_ps(a, b), high_cd = _mm256_unpackhi_ps(c, d);
    out[k] = (Float)_mm256_shuffle_ps(low_ab, low_cd, 0x44);
    out[k + 1] = (Float)_mm256_shuffle_ps(low_ab, low_cd, 0xee);
    if (k + 2 < count) out[k + 2] = (Float)_mm256_shuffle_ps(high_ab, high_cd, 0x44);
    if (k + 3 < count) out[k + 3] = (Float)_mm256_shuffle_ps(high_ab, high_cd, 0xee);
#else
    const __m128 a = some(0), b = some(1), c = some(2), d = some(3);
    const __m128 low_ab = _mm_unpacklo_ps(a, b), low_cd = _mm_unpacklo_ps(c, d);
    const __m128 high_ab = _mm_unpackhi_ps(a, b), high_cd = _mm_unpackhi_ps(c, d);
    out[k] = (Float)_mm_movelh_ps(low_ab, low_cd);
    out[k + 1] = (Float)_mm_movehl_ps(low_cd, low_ab);
    if (k + 2 < count) out[k + 2] = (Float)_mm_movelh_ps(high_ab, high_cd);
    if (k + 3 < count) out[k + 3] = (Float)_mm_movehl_ps(high_cd, high_ab);
#endif
}
#endif

// N consecutive floats of each lane's row.
template <int N, typename R>
EG_INLINE void gather_row(const float* base, int stride, const R& row, Float (&out)[N]) {
    const float* rows[W];
    for (int i = 0; i < W; ++i) rows[i] = base + stride * static_cast<int64_t>(row[i]);
#if defined(__AVX512VL__) && EDGEGRAD_WIDTH == 16
    // Reads four floats of each row at a time and transposes them, which is faster than reading them one by
    // one.
    for (int k = 0; k < N; k += 4) {
        const __mmask8 some = static_cast<__mmask8>(N - k < 4 ? (1 << (N - k)) - 1 : 15);
        __m512 r[4];
        for (int j = 0; j < 4; ++j) {
            const auto four = [&](int i) { return _mm_maskz_loadu_ps(some, rows[i] + k); };
            r[j] = _mm512_zextps128_ps512(four(j));
            r[j] = _mm512_insertf32x4(r[j], four(j + 4), 1);
            r[j] = _mm512_insertf32x4(r[j], four(j + 8), 2);
            r[j] = _mm512_insertf32x4(r[j], four(j + 12), 3);
        }
        const auto low = [](__m512 a, __m512 b) { return _mm512_maskz_unpacklo_ps(kAllLanes, a, b); };
        const auto high = [](__m512 a, __m512 b) { return _mm512_maskz_unpackhi_ps(kAllLanes, a, b); };
        // Rows j and j + 2 side by side: first columns 0 and 1, then columns 2 and 3.
        const __m512 even01 = low(r[0], r[2]), odd01 = low(r[1], r[3]);
        const __m512 even23 = high(r[0], r[2]), odd23 = high(r[1], r[3]);
        out[k] = (Float)low(even01, odd01);
        if (k + 1 < N) out[k + 1] = (Float)high(even01, odd01);
        if (k + 2 < N) out[k + 2] = (Float)low(even23, odd23);
        if (k + 3 < N) out[k + 3] = (Float)high(even23, odd23);
    }
#else
    int done = 0;
#if defined(__SSE4_2__) && (EDGEGRAD_WIDTH == 4 || EDGEGRAD_WIDTH == 8)
    for (; done + 1 < N; done += 4) gather_columns(rows, done, N, out);
#endif
    for (int k = done; k < N; ++k) {
        Float column{};
        for (int i = 0; i < W; ++i) column[i] = rows[i][k];
        out[k] = column;
    }
#endif
}

// A value without its derivative, for densities and other quantities that only decide what is sampled.
EG_INLINE Float detach(Float a) { return a; }

// Sums of products that adjoint/number.h records as one operation each.
EG_INLINE Float sum_of_products(Float a, Float b, Float c, Float d, Float e, Float f) {
    return a * b + c * d + e * f;
}
EG_INLINE Float difference_of_products(Float a, Float b, Float c, Float d) { return a * b - c * d; }
EG_INLINE Float lerp(Float a, Float b, Float t) { return a + (b - a) * t; }
EG_INLINE Float interpolate(Float p0, Float p1, Float p2, Float b1, Float b2) {
    return p0 + (p1 - p0) * b1 + (p2 - p0) * b2;
}

// Appends only the lanes of the mask at p + n. Needs room for one packet behind p + n.
#if defined(__AVX512F__) && EDGEGRAD_WIDTH == 16
template <typename V, typename T>
EG_INLINE int append(T* p, int n, Mask m, V a) {
    const __mmask16 lanes = _mm512_test_epi32_mask((__m512i)m, (__m512i)m);
    const int count = __builtin_popcount(lanes);
    // Compress in a register first: a compressing store to memory takes hundreds of cycles on some
    // processors.
    const __m512i packed = _mm512_maskz_compress_epi32(lanes, (__m512i)a);
    _mm512_mask_storeu_epi32(p + n, static_cast<__mmask16>((1u << count) - 1u), packed);
    return n + count;
}
#elif defined(__AVX2__) && EDGEGRAD_WIDTH == 8
// Byte k of entry m is the k-th set lane of the mask m.
struct LaneOrder {
    uint64_t order[256];
};
constexpr LaneOrder make_lane_order() {
    LaneOrder t{};
    for (int m = 0; m < 256; ++m) {
        int at = 0;
        for (uint64_t lane = 0; lane < 8; ++lane)
            if (m >> lane & 1) t.order[m] |= lane << (8 * at++);
    }
    return t;
}
inline constexpr LaneOrder kLaneOrder = make_lane_order();

template <typename V, typename T>
EG_INLINE int append(T* p, int n, Mask m, V a) {
    const int lanes = _mm256_movemask_ps((__m256)m);
    const int count = __builtin_popcount(static_cast<unsigned>(lanes));
    const __m256i order =
        _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(static_cast<long long>(kLaneOrder.order[lanes])));
    const Int packed = (Int)_mm256_permutevar8x32_epi32((__m256i)a, order);
    Int kept;
    __builtin_memcpy(&kept, p + n, sizeof kept);
    const Int joined = select(first_lanes(count), packed, kept);
    __builtin_memcpy(p + n, &joined, sizeof joined);
    return n + count;
}
#else
template <typename V, typename T>
EG_INLINE int append(T* p, int n, Mask m, V a) {
    for (int i = 0; i < W; ++i)
        if (m[i]) p[n++] = a[i];
    return n;
}
#endif

// Cosine and sine of 2 pi x for x in [0, 1): reduced to [-1/8, 1/8] turns, then Taylor polynomials
// (relative error below 1e-7).
EG_INLINE void sincos_turn(Float x, Float& s, Float& c) {
    const Int quadrant = to_int(x * 4.0f + 0.5f);
    const Float r = (x - to_float(quadrant) * 0.25f) * 6.283185307f;
    const Float r2 = r * r;
    const Float sr =
        r * (1.0f + r2 * (-1.0f / 6 + r2 * (1.0f / 120 + r2 * (-1.0f / 5040 + r2 * (1.0f / 362880)))));
    const Float cr = 1.0f + r2 * (-0.5f + r2 * (1.0f / 24 + r2 * (-1.0f / 720 + r2 * (1.0f / 40320))));
    const Mask swap = (quadrant & 1) != 0;
    const Float s1 = select(swap, cr, sr), c1 = select(swap, sr, cr);
    s = select((quadrant & 2) != 0, -s1, s1);
    c = select(((quadrant + 1) & 2) != 0, -c1, c1);
}

}  // namespace edgegrad::EDGEGRAD_ISA
