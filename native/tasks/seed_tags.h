// Tags of seeds, which give the estimators of one call independent random numbers. Kinds of boundary samples
// also differ by their number (boundary_stream of boundary/samples/segment_sampling.h).
#pragma once

#include <cstdint>

namespace edgegrad {

constexpr uint32_t kSecondPassSeed = 0x3c6ef372u;  // of boundary samples and scan lines
constexpr uint32_t kEdgeOnSeed = 0x3c6ef372u;  // paths, whose streams differ from those of boundary samples
constexpr uint32_t kScanLineSeed = 0x68bc21ebu;
constexpr uint32_t kHorizonSeed = 0x1f83d9abu;
constexpr uint32_t kRimSeed = 0x9b05688cu;
constexpr uint32_t kWindowSeed = 0xa54ff53au;  // of edges of instances, and their boundary samples
constexpr uint32_t kWarpSeed = 0x2f7a91b3u;    // of paths of the warped picture
constexpr uint32_t kLensSeed =
    0x6c656e73u;  // of the points of the lens that outlines of fields are seen from
constexpr uint32_t kDenseSeed = 0x64656e73u;  // of pixels with more samples than others
constexpr uint32_t kBeamSeed = 0x6265616du;   // of the pilot of light beams
constexpr uint32_t kReachSeed = 0x72656163u;  // of paths to places that edges reach
constexpr uint32_t kPilotSeed = 0x510e527fu;
constexpr uint32_t kDistributionSeed = 0xcbbb9d5du;  // of the pilot over the whole picture

}  // namespace edgegrad
