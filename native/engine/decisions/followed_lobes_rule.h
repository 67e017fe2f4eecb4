// Which lobes a derivative's call follows: mirrors and glass whose microfacet's normal is held
// (shading/bsdf/followed_lobes.h).
#pragma once

#include "boundary/curves/candidates.h"

namespace edgegrad {

// The alpha up to which lobes are followed where the camera sees them by such lobes alone; 0: none is. Of
// what moves in such a lobe the edges are found by scan lines (boundary/specular/chain_term.h), as in
// mirrors. Scenes with jumps of light that those don't find, and that other estimators do, follow none.
float followed_alpha(const EdgeList& edges, const RequestedMotion& motion);

}  // namespace edgegrad
