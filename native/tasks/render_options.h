// What a picture or a derivative is told besides the scene.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "tasks/derivative_part.h"
#include "tasks/image_task.h"

namespace edgegrad {

// Up to this alpha, lobes through which the camera sees edges between other surfaces are sampled from the
// camera (boundary/terms/camera_sampled.h).
constexpr float kCameraSampledAlpha = 0.25f;

// Searches list so many edges of instances, which take some hundred megabytes.
constexpr int64_t kMostPlacedEdges = int64_t{1} << 22;

struct RenderOptions {
    int32_t samples = 1;
    uint32_t seed = 0;
    int32_t max_depth = 2;
    BounceLimits limits;
    bool terms[kDerivativeTerms] = {};  // those that are computed, of a derivative
    bool caustics_alone = false;        // of a picture: the part of it that is caustics (path/path_queue.h)
    // Choices between estimators of the same mean, which tests compare.
    bool two_passes = true;  // a first pass over edges says where a second one takes its samples
    float camera_sampled_alpha = kCameraSampledAlpha;
    int64_t most_placed_edges = kMostPlacedEdges;  // of instances, by search (EdgeList::windows)
    // For tests: parts of a derivative (bits, tasks/derivative_part.h) that are computed though they are
    // zero.
    uint64_t force = 0;

    // The same with a share of the samples, at least one, and random numbers of their own.
    RenderOptions part(double share, uint32_t seed_tag = 0) const {
        RenderOptions o = *this;
        o.samples = std::max(1, static_cast<int32_t>(std::lround(share * samples)));
        o.seed ^= seed_tag;
        return o;
    }
};

}  // namespace edgegrad
