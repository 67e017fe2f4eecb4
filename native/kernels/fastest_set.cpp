// Prints the fastest instruction set that this machine runs. The build runs it for EDGEGRAD_KERNELS=native.
#include <cstdio>

#include "util/cpu_features.h"

int main() {
    std::puts(EDGEGRAD_RUNS_avx512  ? "avx512"
              : EDGEGRAD_RUNS_avx2  ? "avx2"
              : EDGEGRAD_RUNS_sse42 ? "sse42"
                                    : "");
}
