// Zeroed memory that costs nothing until it is written to.
#pragma once

#include <cstdlib>
#include <new>
#include <utility>
#include <vector>

namespace edgegrad {

// Allocates memory that the operating system clears page by page at the first write. Vectors do not
// initialise the elements by which they grow, so their memory must be zero when a vector grows again.
template <typename T>
struct ZeroedAllocator {
    using value_type = T;

    ZeroedAllocator() = default;
    template <typename U>
    ZeroedAllocator(const ZeroedAllocator<U>&) {}

    T* allocate(size_t count) {
        void* memory = std::calloc(count, sizeof(T));
        if (!memory) throw std::bad_alloc();
        return static_cast<T*>(memory);
    }
    void deallocate(T* memory, size_t) { std::free(memory); }

    template <typename U>
    void construct(U*) noexcept {}
    template <typename U, typename... Arguments>
    void construct(U* place, Arguments&&... arguments) {
        ::new (static_cast<void*>(place)) U(std::forward<Arguments>(arguments)...);
    }

    bool operator==(const ZeroedAllocator&) const { return true; }
};

using Zeros = std::vector<double, ZeroedAllocator<double>>;

}  // namespace edgegrad
