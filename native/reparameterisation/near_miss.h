// Where camera rays nearly miss a distance field, or just meet it: the local minima of the field along a ray,
// as functions of the ray's place s in the picture.
//
// Let x = o + t D be the ray, with D of unit depth, and t* the depth where g . D = 0. The value there,
// phi*(s) = phi(x(t*, s)), is negative where the ray meets the surface and zero on the outline. Since
// g . D = 0, the motion of t* does not change it (envelope theorem), neither with the picture's place,
//   dphi*/ds_i = m g . E_i,   E_i = dD/ds_i, m = t (perspective) or E_i = do/ds_i, m = 1 (orthographic),
// nor with the field: dphi*/dtheta = dphi(x*). All of it is computed in grid coordinates: an affine map keeps
// minima.
#pragma once

#include "sdf/field_band.h"
#include "sdf/outline_point.h"

namespace edgegrad {

// A ray of a perspective or orthographic camera, in the world.
struct PictureRay {
    double origin[3], direction[3];
    double across[2][3];  // E_x and E_y
    bool parallel;        // orthographic
    double near, far;     // depths
};

struct NearMiss {
    const FieldView* field;
    double depth, grid[3];
    SplineJet jet;
    double slope[2];     // of phi* by the place in the picture
    double bend[3];      // its second derivatives xx, xy, yy
    double moves[2][3];  // of the point by the place in the picture, in grid coordinates
    double curvature;    // second derivative along the ray, by depth
    double width;        // of half of the band, in units of phi*
    // The distance from the outline in units of the band: phi* over the length of its slope, negative inside
    // of the surface; and its slope.
    double apart, apart_slope[2];

    double square() const { return slope[0] * slope[0] + slope[1] * slope[1]; }
};

// Derives everything else from field, depth, grid and jet. Returns whether the ray passes within the band.
bool see_near_miss(const PictureRay& ray, const FieldBand& band, NearMiss& miss);

// Near misses of one ray beyond these are left out: the farthest ones.
constexpr int kMostNearMisses = 4;

}  // namespace edgegrad
