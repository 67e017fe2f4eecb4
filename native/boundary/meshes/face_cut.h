// The lines along which triangles intersect, in double precision.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "boundary/meshes/trees/face_tree.h"
#include "boundary/meshes/trees/placement.h"

namespace edgegrad {

// A point closer to a plane than this, relative to the coordinates, lies on the plane.
constexpr double kOnPlane = 1e-6;
// Squared sine of the smallest angle between two planes that counts as an intersection. The velocity of the
// line grows without bound as the angle goes to zero.
constexpr double kParallel = 1e-6;

struct Triangle3 {
    std::array<Vector, 3> p;
    Vector normal;  // of length |M|
    double size;    // largest coordinate

    Triangle3(Vector p0, Vector p1, Vector p2) : p{p0, p1, p2}, normal(cross(p1 - p0, p2 - p0)), size(0.0) {
        for (const Vector& v : p) size = std::max({size, std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    }
    // A face, placed by an instance.
    Triangle3(const SceneTables& t, int32_t face, Placement place = {})
        : Triangle3(place(vector_at(corner(t, face, 0))), place(vector_at(corner(t, face, 1))),
                    place(vector_at(corner(t, face, 2)))) {}
};

// Computes the segment of `t` in the plane of `other`. False if there is none, or if an edge of `t` lies in
// the plane.
inline bool cut(const Triangle3& t, const Triangle3& other, Vector (&ends)[2]) {
    const double tolerance = kOnPlane * std::max(t.size, other.size) * length(other.normal);
    double height[3];
    int on = 0;
    for (size_t k = 0; k < 3; ++k) {
        height[k] = dot(other.normal, t.p[k] - other.p[0]);
        on += std::abs(height[k]) <= tolerance;
    }
    if (on >= 2) return false;
    int found = 0;
    for (size_t k = 0; k < 3 && found < 2; ++k) {
        const size_t next = (k + 1) % 3;
        if ((height[k] < 0.0) == (height[next] < 0.0)) continue;
        ends[found++] = t.p[k] + (t.p[next] - t.p[k]) * (height[k] / (height[k] - height[next]));
    }
    return found == 2;
}

// Computes the segment that two triangles share. False if there is none.
inline bool shared_line(const Triangle3& s, const Triangle3& t, Vector (&ends)[2]) {
    const Vector along = cross(s.normal, t.normal);
    const double sine2 = dot(along, along), scale2 = dot(s.normal, s.normal) * dot(t.normal, t.normal);
    if (!(sine2 > kParallel * scale2)) return false;
    Vector a[2], b[2];
    if (!cut(s, t, a) || !cut(t, s, b)) return false;
    // Both cuts lie on one line. Their overlap runs from the second to the third of the four sorted ends.
    if (dot(along, a[0]) > dot(along, a[1])) std::swap(a[0], a[1]);
    if (dot(along, b[0]) > dot(along, b[1])) std::swap(b[0], b[1]);
    ends[0] = dot(along, a[0]) > dot(along, b[0]) ? a[0] : b[0];
    ends[1] = dot(along, a[1]) < dot(along, b[1]) ? a[1] : b[1];
    return dot(along, ends[1] - ends[0]) > 0.0 &&
           length(ends[1] - ends[0]) > kOnPlane * std::max(s.size, t.size);
}

// Whether two triangles lie in one plane, face the same way, and overlap in more than a line.
inline bool coincide(const Triangle3& s, const Triangle3& t) {
    const double facing = dot(s.normal, t.normal);
    const Vector along = cross(s.normal, t.normal);
    if (!(facing > 0.0) || dot(along, along) > kParallel * facing * facing) return false;
    const double tolerance = kOnPlane * std::max(s.size, t.size);
    for (const Vector& p : s.p)
        if (std::abs(dot(t.normal, p - t.p[0])) > tolerance * length(t.normal)) return false;
    // Separated by a line along an edge of one of them?
    for (const Triangle3* one : {&s, &t})
        for (size_t k = 0; k < 3; ++k) {
            const Vector across = cross(one->normal, one->p[(k + 1) % 3] - one->p[k]);
            double low[2] = {1e300, 1e300}, high[2] = {-1e300, -1e300};
            for (size_t i = 0; i < 3; ++i) {
                const double at[2] = {dot(across, s.p[i] - s.p[0]), dot(across, t.p[i] - s.p[0])};
                for (size_t n = 0; n < 2; ++n)
                    low[n] = std::min(low[n], at[n]), high[n] = std::max(high[n], at[n]);
            }
            if (std::min(high[0], high[1]) - std::max(low[0], low[1]) <= tolerance * length(across))
                return false;
        }
    return true;
}

}  // namespace edgegrad
