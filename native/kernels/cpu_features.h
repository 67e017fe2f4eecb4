// What a processor must have to run the kernels of each instruction set of x86 (CMakeLists.txt:
// edgegrad_kernels).
#pragma once

#define EDGEGRAD_RUNS_avx512                                                     \
    (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&  \
     __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw") && \
     __builtin_cpu_supports("avx512cd"))
#define EDGEGRAD_RUNS_avx2                                                                               \
    (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi") && \
     __builtin_cpu_supports("bmi2"))
#define EDGEGRAD_RUNS_sse42 (__builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("popcnt"))
