// Options of a picture or a derivative.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "tasks/derivative_part.h"
#include "tasks/image_task.h"

namespace edgegrad {

// Up to this alpha, lobes through which the camera sees edges between other surfaces, or shadows, are sampled
// from the camera (boundary/terms/camera_sampled.h, boundary/terms/camera_sampled_shadow.h).
constexpr float kCameraSampledAlpha = 0.5f;
// The limit of transmitting lobes as a multiple of it. Refraction spreads rays less, and samples that start
// at edges behind a body of rough glass have to pass two of its lobes.
constexpr float kCameraSampledThrough = 2.0f;
// The limit of gloss over a diffuse base as a multiple of it: the base's samples start at edges anyway.
constexpr float kWeakCameraSampled = 0.125f;
// Of shadows of lights of the table and of emissive meshes behind the first surface, reflecting lobes are
// sampled from the camera up to this part of it: wider ones have less noise by samples that start at edges.
constexpr float kReflectedShadows = 0.08f;

// Searches list so many edges of instances, which take some hundred megabytes.
constexpr int64_t kMostPlacedEdges = int64_t{1} << 22;

// How derivatives by distance fields estimate what their outlines change in the picture.
enum class FieldEdges : int32_t {
    kOutlines,         // samples of the outlines (boundary/terms/field_outline.h)
    kReparameterised,  // a warp of the picture (reparameterisation/picture_warp.h)
    kRelaxed,          // samples in bands about the outlines, biased (boundary/terms/relaxed_outline.h)
};
constexpr const char* kFieldEdges[] = {"outlines", "reparameterised", "relaxed"};

struct RenderOptions {
    int32_t samples = 1;
    uint32_t seed = 0;
    int32_t max_depth = 2;
    BounceLimits limits;
    float filter_glossy = 0.0f;         // least_alpha_behind (shading/bsdf/filter_glossy.h)
    bool terms[kDerivativeTerms] = {};  // terms of a derivative to compute
    bool caustics_alone = false;        // a picture of its caustics only (path/path_queue.h)
    FieldEdges field_edges = FieldEdges::kOutlines;
    // Choices between estimators with equal means, for comparisons in tests.
    bool two_passes = true;  // a first pass over edges distributes the samples of a second pass
    float camera_sampled_alpha = kCameraSampledAlpha;
    // Edges of instances up to which a search lists all of them (EdgeList::windows)
    int64_t most_placed_edges = kMostPlacedEdges;
    // For tests: parts that are computed even if they are decided to be zero.
    PartSet force;

    // The same options with a fraction of the samples, at least one, and independent random numbers.
    RenderOptions part(double share, uint32_t seed_tag = 0) const {
        RenderOptions o = *this;
        o.samples = std::max(1, static_cast<int32_t>(std::lround(share * samples)));
        o.seed ^= seed_tag;
        return o;
    }
};

}  // namespace edgegrad
