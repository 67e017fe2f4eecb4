// Points of the outline of a distance field: where its surface is tangent to the rays of a viewer.
//
// With g the gradient of the field and v(x) the direction of the viewer's ray at x, the outline is the curve
//   phi = 0,  G = g . v = 0,  of tangent g x grad G,  grad G = H v + weight g   (derivations of fields, 2).
// All of it is computed in grid coordinates: an affine map keeps the outline.
#pragma once

#include "sdf/field_view.h"

namespace edgegrad {

// A point from which rays start (weight 1), or a direction that they share (weight 0), in grid coordinates:
// v(x) = weight x - from.
struct FieldViewer {
    double from[3], weight;

    void direction(const double (&x)[3], double (&v)[3]) const {
        for (int a = 0; a < 3; ++a) v[a] = weight * x[a] - from[a];
    }
};
FieldViewer viewer_at(const FieldView& f, const double (&point)[3]);
FieldViewer viewer_along(const FieldView& f, const double (&direction)[3]);

// The spline at a point in grid coordinates, in double precision. The Hessian is xx, yy, zz, yz, xz, xy.
struct SplineJet {
    double value, gradient[3], hessian[6];
};
SplineJet spline_jet(const FieldView& f, const double (&grid)[3]);
double spline_value(const FieldView& f, const double (&grid)[3]);

// Moves a point onto the outline along g and grad G, by Newton's method. Returns whether that has converged
// near the point, within the field's box. `clear` tells whether the rays around stay outside of the surface
// there (v . H v > 0); otherwise they come out of it.
bool pull_to_outline(const FieldView& f, const FieldViewer& viewer, double (&grid)[3], bool& clear);

// Moves a point along a ray of direction v (in grid coordinates) to where the ray is tangent to a level set
// of the field. Returns whether Newton's method has converged near the point.
bool move_to_tangency(const FieldView& f, const double (&v)[3], double (&grid)[3]);

// Whether a ray of direction v (in grid coordinates) that touches the surface at a point is outside of it
// before and behind. If so, sets the length, in the world, over which it touches up to rounding. `side`: +1,
// or -1 for rays that have to be inside.
bool touches_outside(const FieldView& f, const double (&grid)[3], const double (&v)[3], float& contact,
                     double side = 1.0);

struct OutlinePoint {
    double grid[3];
    // In the world; the unit normal points to the side on which the viewer's ray stays: out of the surface,
    // or into it.
    float position[3], normal[3];
    float tangent[3];  // how the position changes with u
    float slope;       // length of the gradient in the world
    // Whether the outline runs back here, against the order of the segment's ends. The point then counts
    // negatively, so that the segments of a curve cover it exactly once.
    bool reversed;
    // The viewer's ray touches the surface over this length before and behind the point, up to rounding.
    float contact;
};

// The point of the outline in the plane across the segment from `a` to `b` at the fraction u. The ends are
// points of the outline, ordered as its tangent. Neighbouring segments share their ends: their points cover
// the outline without gaps. Returns false where there is none, or where rays come out of the surface and no
// light travels inside (FieldView::inside).
bool outline_point(const FieldView& f, const FieldViewer& viewer, const float (&a)[3], const float (&b)[3],
                   float u, OutlinePoint& out);

}  // namespace edgegrad
