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
constexpr int kMaxWidth = 16;

}  // namespace edgegrad
