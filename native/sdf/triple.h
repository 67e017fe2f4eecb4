// Three numbers in grid coordinates, and Hessians as a field's spline has them: xx, yy, zz, yz, xz, xy.
#pragma once

namespace edgegrad {

using Triple = double[3];

inline double dot(const Triple& a, const Triple& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline void cross(const Triple& a, const Triple& b, Triple& out) {
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        out[i] = a[j] * b[k] - a[k] * b[j];
    }
}
inline void times(const double (&hessian)[6], const Triple& v, Triple& out) {
    const auto& h = hessian;
    out[0] = h[0] * v[0] + h[5] * v[1] + h[4] * v[2];
    out[1] = h[5] * v[0] + h[1] * v[1] + h[3] * v[2];
    out[2] = h[4] * v[0] + h[3] * v[1] + h[2] * v[2];
}

}  // namespace edgegrad
