// Chooses the followed lobes of a derivative: lobes that are differentiated at a fixed microfacet normal
// (shading/bsdf/followed_lobes.h).
#pragma once

#include "boundary/curves/candidates.h"

namespace edgegrad {

// No lobe of a larger alpha is followed.
constexpr float kWidestFollowed = 0.0905f;

// Limits of the alpha of followed lobes, and of others.
struct FollowedAlpha {
    float all = 0.0f;  // of all light; 0: no lobe is followed
    // (L) Their largest alpha for light of each row of the light table, which rays of wider ones
    // do not meet; 0 for lights without size. Empty: no lobe is followed.
    std::vector<float> by_row;
    std::vector<float> tail;  // by row as well (SceneView::light_tail)
    // The largest alpha of lobes that throw light on other surfaces (SceneView::thrown_alpha)
    float thrown = 0.0f;
    float lobe_samples = 0.0f;  // largest width of lobes that emitter samples of recorded paths sample
};

// Lobes are followed if the camera sees them directly or by other followed lobes. Scan lines find the edges
// that such lobes show (boundary/specular/chain_term.h), as in mirrors. In scenes with jumps of radiance that
// only other estimators find, no lobe is followed.
FollowedAlpha followed_alpha(const EdgeList& edges, const RequestedMotion& motion);

}  // namespace edgegrad
