#include "sdf/outline_point.h"

#include <cmath>
#include <initializer_list>

#include "sdf/triple.h"
#include "util/cpu_features.h"

namespace edgegrad {
namespace {

// Newton's method stops after a step of so many cells: the next one would be about as long as its square. It
// fails after so many steps or so far from its start.
constexpr double kResolved = 3e-5, kFar = 1.5;
constexpr int kMostSteps = 20;
// Rays through points of an outline touch the surface over so many cells.
constexpr double kContactCells = 0.125;

bool within(const FieldView& f, const Triple& x) {
    for (int a = 0; a < 3; ++a)
        if (!(x[a] >= 0.0 && x[a] <= f.cells(a))) return false;
    return true;
}
bool near(const Triple& x, const Triple& start) {
    const Triple d = {x[0] - start[0], x[1] - start[1], x[2] - start[2]};
    return dot(d, d) < kFar * kFar;
}

// The two equations of the outline at a point, and the ray's direction.
struct OutlineEquations {
    SplineJet at;
    Triple v, bent, gradient;  // v, H v, grad G
    double grazing;            // G

    OutlineEquations(const FieldView& f, const FieldViewer& viewer, const Triple& x) : at(spline_jet(f, x)) {
        viewer.direction(x, v);
        times(at.hessian, v, bent);
        for (int a = 0; a < 3; ++a) gradient[a] = bent[a] + viewer.weight * at.gradient[a];
        grazing = dot(at.gradient, v);
    }
    double curvature() const { return dot(v, bent); }
};

typedef double Four __attribute__((vector_size(32)));

inline __attribute__((always_inline)) double total(const Four& a) { return (a[0] + a[2]) + (a[1] + a[3]); }

// Passed by reference: a vector as a result has another calling convention with each instruction set.
inline __attribute__((always_inline)) void value_weights(double u, Four& weight) {
    const double v = 1.0 - u;
    weight = Four{v * v * v / 6.0, (4.0 - 3.0 * u * u * (1.0 + v)) / 6.0,
                  (4.0 - 3.0 * v * v * (1.0 + u)) / 6.0, u * u * u / 6.0};
}

// The coefficients that a point reads, and its place in the cell.
class SplineCell {
 public:
    SplineCell(const FieldView& f, const double (&grid)[3]) : step_(f.size[2]), slab_(step_ * f.size[1]) {
        int64_t cell[3];
        for (int a = 0; a < 3; ++a) at[a] = f.place_in_cell(grid, a, cell[a]);
        first_ = f.values + cell[0] * slab_ + cell[1] * step_ + cell[2];
    }
    __attribute__((always_inline)) void row(int i, int j, Four& out) const {
        const float* r = first_ + i * slab_ + j * step_;
        out = Four{static_cast<double>(r[0]), static_cast<double>(r[1]), static_cast<double>(r[2]),
                   static_cast<double>(r[3])};
    }
    double at[3];

 private:
    int64_t step_, slab_;
    const float* first_;
};

// Sums with the instructions of the caller: samples of outlines and of shadows spend most of their time here.
inline __attribute__((always_inline)) void sum_jet(const SplineCell& c, SplineJet& out) {
    Four w[3], d[3], b[3];  // the weights of a value, a slope and a second derivative along each axis
    for (int a = 0; a < 3; ++a) {
        const double u = c.at[a], v = 1.0 - u;
        value_weights(u, w[a]);
        d[a] = Four{-0.5 * v * v, 0.5 * u * (3.0 * u - 4.0), 0.5 * v * (4.0 - 3.0 * v), 0.5 * u * u};
        b[a] = Four{v, 3.0 * u - 2.0, 1.0 - 3.0 * u, u};
    }
    // The sums along z come last, so that all four taps of a row are read together
    Four value{}, x{}, y{}, xx{}, yy{}, xy{};
    for (int i = 0; i < 4; ++i) {
        Four flat{}, turned{}, bent{};
        for (int j = 0; j < 4; ++j) {
            Four row;
            c.row(i, j, row);
            flat += row * w[1][j], turned += row * d[1][j], bent += row * b[1][j];
        }
        value += flat * w[0][i], x += flat * d[0][i], xx += flat * b[0][i];
        y += turned * w[0][i], xy += turned * d[0][i], yy += bent * w[0][i];
    }
    out.value = total(value * w[2]);
    out.gradient[0] = total(x * w[2]), out.gradient[1] = total(y * w[2]),
    out.gradient[2] = total(value * d[2]);
    out.hessian[0] = total(xx * w[2]), out.hessian[1] = total(yy * w[2]),
    out.hessian[2] = total(value * b[2]);
    out.hessian[3] = total(y * d[2]), out.hessian[4] = total(x * d[2]), out.hessian[5] = total(xy * w[2]);
}

inline __attribute__((always_inline)) double sum_value(const SplineCell& c) {
    Four wx, wy, wz, sum{};
    value_weights(c.at[0], wx), value_weights(c.at[1], wy), value_weights(c.at[2], wz);
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j) {
            Four row;
            c.row(i, j, row);
            sum += row * (wx[i] * wy[j]);
        }
    return total(sum * wz);
}

#if defined(__x86_64__)
__attribute__((target("avx2,fma"))) double sum_value_with_avx2(const SplineCell& c) { return sum_value(c); }
__attribute__((target("avx2,fma"))) void sum_jet_with_avx2(const SplineCell& c, SplineJet& out) {
    sum_jet(c, out);
}
#endif

}  // namespace

FieldViewer viewer_at(const FieldView& f, const double (&point)[3]) {
    FieldViewer out{};
    f.place_in_grid(point, out.from);
    out.weight = 1.0;
    return out;
}

FieldViewer viewer_along(const FieldView& f, const double (&direction)[3]) {
    FieldViewer out{};
    f.vector_in_grid(direction, out.from);
    for (double& x : out.from) x = -x;
    return out;
}

double spline_value(const FieldView& f, const double (&grid)[3]) {
    const SplineCell c(f, grid);
#if defined(__x86_64__)
    static const bool avx2 = cpu_features().avx2;
    if (avx2) return sum_value_with_avx2(c);
#endif
    return sum_value(c);
}

SplineJet spline_jet(const FieldView& f, const double (&grid)[3]) {
    const SplineCell c(f, grid);
    SplineJet out;
#if defined(__x86_64__)
    static const bool avx2 = cpu_features().avx2;
    if (avx2) {
        sum_jet_with_avx2(c, out);
        return out;
    }
#endif
    sum_jet(c, out);
    return out;
}

bool pull_to_outline(const FieldView& f, const FieldViewer& viewer, double (&grid)[3], bool& clear) {
    const Triple start = {grid[0], grid[1], grid[2]};
    for (int step = 0; step < kMostSteps; ++step) {
        const OutlineEquations e(f, viewer, grid);
        clear = e.curvature() > 0.0;
        const double gg = dot(e.at.gradient, e.at.gradient), gh = dot(e.at.gradient, e.gradient),
                     hh = dot(e.gradient, e.gradient), det = gg * hh - gh * gh;
        if (!(det > 0.0)) return false;
        const double a = (-e.at.value * hh + e.grazing * gh) / det,
                     b = (-e.grazing * gg + e.at.value * gh) / det;
        double square = 0.0;
        for (int k = 0; k < 3; ++k) {
            const double d = a * e.at.gradient[k] + b * e.gradient[k];
            grid[k] += d, square += d * d;
        }
        if (!near(grid, start)) return false;
        if (square < kResolved * kResolved) return within(f, grid);
    }
    return false;
}

bool move_to_tangency(const FieldView& f, const double (&v)[3], double (&grid)[3]) {
    const Triple start = {grid[0], grid[1], grid[2]};
    const double square = dot(v, v);
    for (int step = 0; step < kMostSteps; ++step) {
        const SplineJet x = spline_jet(f, grid);
        Triple bent;
        times(x.hessian, v, bent);
        const double bend = dot(v, bent), by = -dot(x.gradient, v) / bend;
        if (!(bend != 0.0)) return false;
        for (int k = 0; k < 3; ++k) grid[k] += by * v[k];
        if (!near(grid, start)) return false;
        if (by * by * square < kResolved * kResolved) return true;
    }
    return false;
}

bool touches_outside(const FieldView& f, const double (&grid)[3], const double (&v)[3], float& contact,
                     double side) {
    const double ray = std::sqrt(dot(v, v));
    for (const double way : {-kContactCells, kContactCells}) {
        Triple x;
        for (int k = 0; k < 3; ++k) x[k] = grid[k] + way / ray * v[k];
        if (within(f, x) && side * spline_value(f, x) < 0.0) return false;
    }
    Triple view;
    f.vector_in_world(v, view);
    contact = static_cast<float>(kContactCells * std::sqrt(dot(view, view)) / ray);
    return true;
}

bool outline_point(const FieldView& f, const FieldViewer& viewer, const float (&a)[3], const float (&b)[3],
                   float u, OutlinePoint& out) {
    Triple from, way, start;
    f.place_in_grid(a, from);
    f.place_in_grid(b, way);
    for (int k = 0; k < 3; ++k) {
        way[k] -= from[k];
        start[k] = from[k] + static_cast<double>(u) * way[k];
        out.grid[k] = start[k];
    }
    // Solve phi = 0, G = 0 and the plane's equation by Cramer's rule
    for (int step = 0;; ++step) {
        if (step == kMostSteps) return false;
        const OutlineEquations e(f, viewer, out.grid);
        const Triple off = {out.grid[0] - start[0], out.grid[1] - start[1], out.grid[2] - start[2]};
        Triple tangent, second, third;
        cross(e.at.gradient, e.gradient, tangent);
        cross(e.gradient, way, second);
        cross(way, e.at.gradient, third);
        const double det = dot(tangent, way);
        if (!(std::abs(det) > 0.0)) return false;
        double square = 0.0;
        for (int k = 0; k < 3; ++k) {
            const double d =
                -(e.at.value * second[k] + e.grazing * third[k] + dot(way, off) * tangent[k]) / det;
            out.grid[k] += d, square += d * d;
        }
        if (!near(out.grid, start)) return false;
        if (square < kResolved * kResolved) break;
    }
    const OutlineEquations e(f, viewer, out.grid);
    const double side = e.curvature() > 0.0 ? 1.0 : -1.0;
    if (!within(f, out.grid) || (side < 0.0 && !f.inside)) return false;
    if (!touches_outside(f, out.grid, e.v, out.contact, side)) return false;
    Triple tangent, world, normal, place;
    cross(e.at.gradient, e.gradient, tangent);
    const double det = dot(tangent, way), scale = dot(way, way) / det;
    for (double& t : tangent) t *= scale;
    f.vector_in_world(tangent, world);
    f.gradient_in_world(e.at.gradient, normal);
    f.place_in_world(out.grid, place);
    const double slope = std::sqrt(dot(normal, normal));
    if (!(slope > 0.0)) return false;
    for (int c = 0; c < 3; ++c) {
        out.position[c] = static_cast<float>(place[c]);
        out.normal[c] = static_cast<float>(side * normal[c] / slope);
        out.tangent[c] = static_cast<float>(world[c]);
    }
    out.slope = static_cast<float>(slope);
    out.reversed = det < 0.0;
    return true;
}

}  // namespace edgegrad
