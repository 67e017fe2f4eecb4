// Points of the curves along which the surface of a distance field passes through a plane or through the
// surface of another field.
//
// With the surfaces' heights h1 and h2 (the value of a field over the length of its gradient) and unit
// normals n1 and n2, such a curve is h1 = h2 = 0, of tangent n1 x n2. All of it is computed in the world.
#pragma once

#include "sdf/field_view.h"
#include "util/double_vector.h"

namespace edgegrad {

// One of two surfaces that pass through each other: a field, or the plane of a face.
struct CrossedSurface {
    const FieldView* field;  // null: a plane
    Vector point, normal;    // of the plane; the normal has unit length
};
inline CrossedSurface crossed_field(const FieldView& field) { return {&field, {}, {}}; }

// Surfaces at a squared sine below this are not followed: the velocity of their curve grows without bound as
// the angle goes to zero.
constexpr double kCrossingParallel = 1e-6;

// The unit normal of a surface at a point near it; 0 where the field has no gradient.
Vector unit_normal(const CrossedSurface& surface, Vector at);
// Moves a point onto the curve along the two normals, by Newton's method. Returns whether that has converged
// near the point, within the fields' boxes.
bool pull_to_crossing(const CrossedSurface (&surfaces)[2], Vector& point);
// The same along a line, onto the surface of one field: point = from + part * way.
bool pull_along_line(const FieldView& field, Vector from, Vector way, double& part);

struct CrossingPoint {
    Vector position, normal[2];  // unit normals of the surfaces; those of fields point outwards
    Vector tangent;              // how the position changes with u
    bool reversed;               // the curve runs back here, as in OutlinePoint
};

// The point of the curve in the plane across the segment from `a` to `b` at the fraction u. The ends are
// points of the curve, ordered as its tangent, and shared by neighbouring segments.
bool crossing_point(const CrossedSurface (&surfaces)[2], const float (&a)[3], const float (&b)[3], float u,
                    CrossingPoint& out);

// Whether a ray of the unit direction `ray` meets the field at a point of its surface without another
// crossing of the surface shortly before. `contact` becomes the length of that check.
bool meets_first(const FieldView& field, Vector point, Vector normal, Vector ray, float& contact);

}  // namespace edgegrad
