// The warp of the picture: a continuous velocity v(s) of its points that is that of the outlines of distance
// fields on these outlines, and zero outside of bands about them.
//
// A near miss (reparameterisation/near_miss.h) has the level sets of phi* in the picture, which move at
//   v = -dphi p/|p|^2,   p = dphi*/ds,
// for a change dphi of the field at its point. The warp is the sum of these velocities times weights u that
// are 1 on the outline of their near miss, 0 on all other outlines and at the border of the band. With
// H* the second derivatives of phi* and x_j the motion of the point with s_j,
//   div v = alpha dphi + beta . grad dphi,
//   alpha = -p . grad u/|p|^2 - u (tr H* - 2 p . H* p/|p|^2)/|p|^2,   beta = -u sum_j p_j x_j/|p|^2
// (derivations of fields, section 5).
#pragma once

#include "reparameterisation/near_miss.h"

namespace edgegrad {

// The part of one near miss, as linear forms in dphi and grad dphi at its point.
struct WarpPart {
    const FieldView* field;
    float point[3];  // in the world
    float step[2];   // v = step dphi
    float spread;    // alpha
    float along[3];  // beta
    float slope;     // length of the field's gradient there
};
struct PictureWarp {
    int count = 0;
    WarpPart part[kMostNearMisses];
};
PictureWarp warp_of(const NearMiss* misses, int count);

}  // namespace edgegrad
