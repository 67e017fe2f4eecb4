// Points of a distance field's surface by its area, and rays that touch the surface there.
//
// A patch is a triangle near the surface (FieldCarrier, sdf/carrier/carrier.h) with the field's gradients at
// its corners. Each of its points is moved onto the surface along the interpolated gradient. Neighbours share
// corners and gradients, so that the patches of a carrier cover the surface without gaps.
#pragma once

#include "sdf/outline_point.h"

namespace edgegrad {

struct FieldPatch {
    float point[3][3], gradient[3][3];  // of the corners, in grid coordinates
};

struct PatchPoint {
    double grid[3];
    SplineJet jet;
    float position[3], normal[3];  // in the world; the unit normal points out of the surface
    float slope;                   // length of the gradient in the world
    // The surface's area per unit of (u, v). Negative where the patch runs back, so that the patches cover
    // the surface exactly once.
    float area;
};

// The point of a patch at (u, v) of the unit square, which maps uniformly to the triangle. Returns false
// where there is none near the patch.
bool patch_point(const FieldView& f, const FieldPatch& patch, float u, float v, PatchPoint& out);

// The normal curvature of the surface along a tangent (unit, in the world), positive where rays along it stay
// outside and negative where they stay inside, and the length over which they touch (touches_outside).
// Returns false where they do not stay on one side, or stay inside where no light travels.
bool tangent_ray(const FieldView& f, const PatchPoint& at, const float (&along)[3], float& curvature,
                 float& contact);

// The second fundamental form for unit tangents a and b (in the world): a . H a / |g|, and so on.
struct TangentCurvatures {
    float aa, bb, ab;
};
TangentCurvatures tangent_curvatures(const FieldView& f, const PatchPoint& at, const float (&a)[3],
                                     const float (&b)[3]);

}  // namespace edgegrad
