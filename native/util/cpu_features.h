// What a processor must have to run the kernels of each instruction set of x86 (CMakeLists.txt:
// edgegrad_kernels). The processor is asked directly: __builtin_cpu_supports needs a table of the compiler's
// run-time library that not every compiler brings.
#pragma once

#if defined(__x86_64__) || defined(_M_X64)

#include <cstdint>

#ifdef _MSC_VER
#include <immintrin.h>
#include <intrin.h>
#else
#include <cpuid.h>
#endif

namespace edgegrad {

struct CpuFeatures {
    bool sse42 = false, avx2 = false, avx512 = false;
};

// The answer of the instruction CPUID for a leaf: eax, ebx, ecx, edx. Zeros for a leaf that the processor
// lacks.
struct CpuidAnswer {
    std::uint32_t a = 0, b = 0, c = 0, d = 0;
};

inline CpuidAnswer ask_cpuid(unsigned leaf) {
    CpuidAnswer r;
#ifdef _MSC_VER
    int found[4];
    __cpuid(found, 0);
    if (static_cast<unsigned>(found[0]) < leaf) return r;
    __cpuidex(found, static_cast<int>(leaf), 0);
    r = {std::uint32_t(found[0]), std::uint32_t(found[1]), std::uint32_t(found[2]), std::uint32_t(found[3])};
#else
    __get_cpuid_count(leaf, 0, &r.a, &r.b, &r.c, &r.d);
#endif
    return r;
}

// The registers that the operating system saves (XCR0); call it only if CPUID says that it can be read.
inline std::uint64_t saved_registers() {
#ifdef _MSC_VER
    return _xgetbv(0);
#else
    std::uint32_t low, high;
    __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    return (std::uint64_t(high) << 32) | low;
#endif
}

inline CpuFeatures cpu_features() {
    const CpuidAnswer one = ask_cpuid(1), seven = ask_cpuid(7);
    const auto in_c = [&](int bit) { return (one.c >> bit & 1u) != 0; };
    const auto in_b = [&](int bit) { return (seven.b >> bit & 1u) != 0; };
    constexpr int kFma = 12, kSse42 = 20, kPopcnt = 23, kXgetbv = 27;                              // leaf 1
    constexpr int kBmi1 = 3, kAvx2 = 5, kBmi2 = 8, kAvx512f = 16, kAvx512dq = 17, kAvx512cd = 28;  // leaf 7
    constexpr int kAvx512bw = 30, kAvx512vl = 31;                                                  // leaf 7
    constexpr std::uint64_t kYmm = 0x6, kZmm = 0xe6;
    const std::uint64_t saved = in_c(kXgetbv) ? saved_registers() : 0;
    CpuFeatures f;
    f.sse42 = in_c(kSse42) && in_c(kPopcnt);
    f.avx2 = f.sse42 && (saved & kYmm) == kYmm && in_b(kAvx2) && in_c(kFma) && in_b(kBmi1) && in_b(kBmi2);
    f.avx512 = f.avx2 && (saved & kZmm) == kZmm && in_b(kAvx512f) && in_b(kAvx512vl) && in_b(kAvx512dq) &&
               in_b(kAvx512bw) && in_b(kAvx512cd);
    return f;
}

}  // namespace edgegrad

#define EDGEGRAD_RUNS_avx512 (edgegrad::cpu_features().avx512)
#define EDGEGRAD_RUNS_avx2 (edgegrad::cpu_features().avx2)
#define EDGEGRAD_RUNS_sse42 (edgegrad::cpu_features().sse42)

#endif
