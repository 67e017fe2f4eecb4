// How many paths and lanes a task has.
#pragma once

#include <cstdint>

namespace edgegrad {

// Paths of one task: enough for compaction to pay, few enough for the cache.
constexpr int kBlockPaths = 8192;
// Of those whose vertices are recorded.
constexpr int kRecordedPaths = 1024;
// Of those that are followed to horizons (boundary/terms/horizon.h).
constexpr int kHorizonPaths = 2048;
// Boundary samples of a task, and of a batch whose values are stored.
constexpr int64_t kBoundaryChunk = 2048;
constexpr int64_t kSplatBatch = int64_t{1} << 20;
constexpr int kMaxWidth = 16;

}  // namespace edgegrad
