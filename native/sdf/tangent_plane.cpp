#include "sdf/tangent_plane.h"

#include "sdf/place_code.h"
#include "sdf/spline.h"

namespace edgegrad::EDGEGRAD_ISA {
namespace {

double larger(double a, double b) { return a > b ? a : b; }
double size_of(double a) { return a < 0.0 ? -a : a; }

double length_of(const double (&v)[3]) { return __builtin_sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

}  // namespace

void tangent_triangle(const FieldView& field, const uint32_t (&code)[2], float (&corners)[3][3]) {
    constexpr double kMostPull = 0.1;    // cells
    constexpr double kRounding = 1e-6;   // of values of the spline, as a share of its coefficients
    constexpr double kRayOffset = 2e-6;  // as in ray_offset, of the largest coordinate
    double grid[3];
    decode_place(field, code, grid);
    int32_t cell[3];
    float at[3];
    find_cell(field, grid, cell, at);
    float largest;
    const FieldPoint p = spline(field, cell, at, largest);
    // Pull by Newton's method in grid coordinates, but not far where the gradient vanishes
    double square = 0.0;
    for (const float slope : p.gradient) square += static_cast<double>(slope) * slope;
    const double step = square > 0.0 ? static_cast<double>(p.value) / square : 0.0;
    if (step * step * square < kMostPull * kMostPull)
        for (int a = 0; a < 3; ++a) grid[a] -= step * static_cast<double>(p.gradient[a]);
    double g[3], x[3];
    field.gradient_in_world(p.gradient, g);
    field.place_in_world(grid, x);
    const double extent = larger(larger(field.extent, size_of(x[0])), larger(size_of(x[1]), size_of(x[2])));
    const double length = length_of(g), inverse = length > 0.0 ? 1.0 / length : 0.0;
    const double n[3] = {g[0] * inverse, g[1] * inverse, length > 0.0 ? g[2] * inverse : 1.0};
    // Rounding moves the surface by this much, at most by a hundredth of a cell
    const double most = 0.01 * field.cell_size,
                 error = length > 0.0 ? kRounding * static_cast<double>(largest) * inverse : most;
    const double size = larger(extent, (error < most ? error : most) * (1.0 / kRayOffset));
    // Tangents (simd/vector.h, basis)
    const double sign = n[2] >= 0.0 ? 1.0 : -1.0, r = -1.0 / (sign + n[2]), q = n[0] * n[1] * r;
    const double u[3] = {1.0 + sign * n[0] * n[0] * r, sign * q, -sign * n[0]};
    const double v[3] = {q, sign + n[1] * n[1] * r, -n[1]};
    for (int c = 0; c < 3; ++c) {
        corners[0][c] = static_cast<float>(x[c]);
        corners[1][c] = static_cast<float>(x[c] + size * u[c]);
        corners[2][c] = static_cast<float>(x[c] + size * v[c]);
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
