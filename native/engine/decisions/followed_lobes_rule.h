// Chooses the followed lobes of a derivative: lobes that are differentiated at a fixed microfacet normal
// (shading/bsdf/followed_lobes.h).
#pragma once

#include "boundary/curves/candidates.h"

namespace edgegrad {

// No lobe of a larger alpha is followed.
constexpr float kWidestFollowed = 0.0905f;

// The largest alpha of followed lobes; 0: none is followed. Lobes are followed if the camera sees them
// directly or by other followed lobes. Scan lines find the edges that such lobes show
// (boundary/specular/chain_term.h), as in mirrors. In scenes with jumps of radiance that only other
// estimators find, no lobe is followed.
float followed_alpha(const EdgeList& edges, const RequestedMotion& motion);

}  // namespace edgegrad
