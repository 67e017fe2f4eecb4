// A block with guard zones: prints what check() says after writes within its arrays, and after one beyond.
#define EDGEGRAD_GUARD_ZONES
#include "util/scratch_block.h"

#include <cstdint>
#include <cstdio>

int main() {
    constexpr size_t kCount = 37;
    edgegrad::ScratchBlock block;
    float *x, *v[3], *m[2][4];
    int32_t* n;
    block.lay_out([&](const auto& take) { take(kCount, x, v, n, m); });
    for (size_t k = 0; k < kCount; ++k) {
        if (x[k] != 0.0f || v[2][k] != 0.0f || n[k] != 0) return 1;
        x[k] = v[0][k] = v[1][k] = v[2][k] = m[0][0][k] = m[1][3][k] = 7.0f, n[k] = 3;
    }
    if (reinterpret_cast<uintptr_t>(v[1]) % 64 != 0) return 1;
    block.check();
    v[1][kCount] = 1.0f;
    try {
        block.check();
    } catch (const std::logic_error& error) {
        std::puts(error.what());
    }
}
