// How many paths and lanes a task has.
#pragma once

#include <cstdint>

namespace edgegrad {

// Paths of one task. With more, compaction saves more; with fewer, they stay in the cache.
constexpr int kBlockPaths = 8192;
// Paths of a task whose vertices are recorded.
constexpr int kRecordedPaths = 1024;
// Paths of a task of the horizon term (boundary/terms/horizon.h).
constexpr int kHorizonPaths = 2048;
// Boundary samples of a task, and of a batch whose values are stored.
constexpr int64_t kBoundaryChunk = 2048;
constexpr int64_t kSplatBatch = int64_t{1} << 20;
constexpr int kMaxWidth = 16;

}  // namespace edgegrad
