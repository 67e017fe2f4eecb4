// Triangles of a scene in double precision, and where planes cut them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "boundary/face_tree.h"

namespace edgegrad {

// Nearer to a plane than this, relative to the coordinates, is on it.
constexpr double kOnPlane = 1e-6;
// Sine squared of the least angle between two faces.
constexpr double kParallel = 1e-6;

struct Triangle3 {
    std::array<Vector, 3> p;
    Vector normal;  // of length |M|
    double size;    // largest coordinate

    Triangle3(const SceneTables& t, int32_t face) : size(0.0) {
        for (size_t k = 0; k < 3; ++k) {
            const float* v = corner(t, face, k);
            p[k] = {v[0], v[1], v[2]};
            size = std::max({size, std::abs(p[k].x), std::abs(p[k].y), std::abs(p[k].z)});
        }
        normal = cross(p[1] - p[0], p[2] - p[0]);
    }
    Triangle3(Vector p0, Vector p1, Vector p2) : p{p0, p1, p2}, normal(cross(p1 - p0, p2 - p0)), size(0.0) {
        for (const Vector& v : p) size = std::max({size, std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    }
};

// The part of `t` that lies in the plane of `other`; false if it has none, or an edge of it does.
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

}  // namespace edgegrad
