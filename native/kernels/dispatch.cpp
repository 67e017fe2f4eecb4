#include "kernels/dispatch.h"

#include <stdexcept>

#include "tasks/kernel_table.h"
#include "util/cpu_features.h"

namespace edgegrad {

// The instruction sets that were built (EDGEGRAD_KERNELS in CMakeLists.txt), the fastest first.
#ifdef EDGEGRAD_HAS_avx512
#define EDGEGRAD_AVX512(X) X(avx512, EDGEGRAD_RUNS_avx512)
#else
#define EDGEGRAD_AVX512(X)
#endif
#ifdef EDGEGRAD_HAS_avx2
#define EDGEGRAD_AVX2(X) X(avx2, EDGEGRAD_RUNS_avx2)
#else
#define EDGEGRAD_AVX2(X)
#endif
#ifdef EDGEGRAD_HAS_sse42
#define EDGEGRAD_SSE42(X) X(sse42, EDGEGRAD_RUNS_sse42)
#else
#define EDGEGRAD_SSE42(X)
#endif
#ifdef EDGEGRAD_HAS_simd4
#define EDGEGRAD_SIMD4(X) X(simd4, true)
#else
#define EDGEGRAD_SIMD4(X)
#endif
#ifdef EDGEGRAD_HAS_scalar
#define EDGEGRAD_SCALAR(X) X(scalar, true)
#else
#define EDGEGRAD_SCALAR(X)
#endif
#define EDGEGRAD_ISAS(X) \
    EDGEGRAD_AVX512(X) EDGEGRAD_AVX2(X) EDGEGRAD_SSE42(X) EDGEGRAD_SIMD4(X) EDGEGRAD_SCALAR(X)

#define EDGEGRAD_DECLARE(isa, supported) \
    namespace isa {                      \
    const KernelTable& kernel_table();   \
    }
EDGEGRAD_ISAS(EDGEGRAD_DECLARE)
#undef EDGEGRAD_DECLARE

std::vector<std::string> instruction_sets() {
    std::vector<std::string> names;
#define EDGEGRAD_LIST(isa, supported) \
    if (supported) names.push_back(#isa);
    EDGEGRAD_ISAS(EDGEGRAD_LIST)
#undef EDGEGRAD_LIST
    return names;
}

const KernelTable& kernels(const std::string& instruction_set) {
#define EDGEGRAD_PICK(isa, supported) \
    if ((supported) && (instruction_set.empty() || instruction_set == #isa)) return isa::kernel_table();
    EDGEGRAD_ISAS(EDGEGRAD_PICK)
#undef EDGEGRAD_PICK
    std::string known;
    for (const std::string& name : instruction_sets()) known += (known.empty() ? "" : ", ") + name;
    throw std::invalid_argument("instruction set '" + instruction_set +
                                "' is not available here; these are: " + known);
}

const KernelTable& with_probes(const KernelTable& table) {
    if (!table.bsdfs)
        throw std::invalid_argument(
            "this build has no probes of single functions; build it with -DEDGEGRAD_KERNELS=native");
    return table;
}

}  // namespace edgegrad
