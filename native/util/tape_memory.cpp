#include "util/tape_memory.h"

#include <cstring>
#include <new>

namespace edgegrad {

namespace {
constexpr std::align_val_t kAlignment{64};
}

TapeBuffer::~TapeBuffer() { ::operator delete(data_, kAlignment); }

void* TapeBuffer::grow(size_t bytes, size_t kept) {
    if (bytes <= size_) return data_;
    const size_t size = bytes > 2 * size_ ? bytes : 2 * size_;
    void* more = ::operator new(size, kAlignment);
    if (kept) std::memcpy(more, data_, kept);
    ::operator delete(data_, kAlignment);
    data_ = more;
    size_ = size;
    return data_;
}

}  // namespace edgegrad
