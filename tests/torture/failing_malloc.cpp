// Preloaded into a test's process: lets one chosen allocation of the process fail.
#include <atomic>
#include <cerrno>
#include <cstddef>

extern "C" {
void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
void* __libc_memalign(size_t, size_t);
}

namespace {
std::atomic<long> seen{0}, failing{0};
std::atomic<bool> armed{false};

bool fails() {
    if (!armed.load(std::memory_order_relaxed)) return false;
    if (++seen != failing) return false;
    errno = ENOMEM;
    return true;
}
}  // namespace

extern "C" {

// Lets the n-th allocation from now on fail (0: none), of any thread.
void arm(long n) {
    seen = 0;
    failing = n;
    armed = true;
}

// The number of allocations since `arm`.
long disarm() {
    armed = false;
    return seen;
}

void* malloc(size_t size) { return fails() ? nullptr : __libc_malloc(size); }
void* calloc(size_t count, size_t size) { return fails() ? nullptr : __libc_calloc(count, size); }
void* realloc(void* old, size_t size) { return fails() ? nullptr : __libc_realloc(old, size); }
void* memalign(size_t alignment, size_t size) { return fails() ? nullptr : __libc_memalign(alignment, size); }
void* aligned_alloc(size_t alignment, size_t size) { return memalign(alignment, size); }
int posix_memalign(void** out, size_t alignment, size_t size) {
    void* const p = memalign(alignment, size);
    if (!p) return ENOMEM;
    *out = p;
    return 0;
}
}
