// Memory of one thread's tape. It is kept from one recording to the next.
#pragma once

#include <cstddef>

namespace edgegrad {

// A growing buffer of bytes, aligned for packets of any width.
class TapeBuffer {
 public:
    TapeBuffer() = default;
    TapeBuffer(const TapeBuffer&) = delete;
    TapeBuffer& operator=(const TapeBuffer&) = delete;
    ~TapeBuffer();
    // Grows to at least `bytes`. The first `kept` bytes keep their values.
    void* grow(size_t bytes, size_t kept);
    void* data() const { return data_; }
    size_t size() const { return size_; }

 private:
    void* data_ = nullptr;
    size_t size_ = 0;
};

struct TapeMemory {
    TapeBuffer ends, partials, closures, derivatives, block_entries, blocks;
    TapeBuffer parts;  // of a recording in parts (adjoint/path_sweeps.cpp)
};

}  // namespace edgegrad
