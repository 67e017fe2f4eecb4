#include "sdf/surface_patch.h"

#include <cmath>

#include "sdf/triple.h"

namespace edgegrad {
namespace {

// The search along a gradient stops at steps of so many cells. It fails after so many steps or so far
// from the patch.
constexpr double kResolved = 1e-6, kFar = 1.0;
constexpr int kMostSteps = 20;

}  // namespace

bool patch_point(const FieldView& f, const FieldPatch& patch, float u, float v, PatchPoint& out) {
    // The map of the square to the triangle has the Jacobian 1/2
    const double root = std::sqrt(static_cast<double>(u)), b1 = root * (1.0 - static_cast<double>(v)),
                 b2 = root * static_cast<double>(v), b0 = 1.0 - root;
    Triple from, along;
    for (int k = 0; k < 3; ++k) {
        from[k] = b0 * patch.point[0][k] + b1 * patch.point[1][k] + b2 * patch.point[2][k];
        along[k] = b0 * patch.gradient[0][k] + b1 * patch.gradient[1][k] + b2 * patch.gradient[2][k];
    }
    const double length = std::sqrt(dot(along, along));
    double way = 0.0;
    for (int step = 0;; ++step) {
        for (int k = 0; k < 3; ++k) out.grid[k] = from[k] + way * along[k];
        out.jet = spline_jet(f, out.grid);
        const double slope = dot(out.jet.gradient, along);
        if (step == kMostSteps || !(std::abs(slope) > 0.0)) return false;
        // Halley's method; the second derivative is at hand
        Triple bent;
        times(out.jet.hessian, along, bent);
        const double newton = -out.jet.value / slope, turn = 1.0 + 0.5 * newton * dot(along, bent) / slope;
        const double by = turn > 0.5 ? newton / turn : newton;
        if (std::abs(by) * length < kResolved) break;
        way += by;
        if (!(std::abs(way) * length < kFar)) return false;
    }
    for (int k = 0; k < 3; ++k)
        if (!(out.grid[k] >= 0.0 && out.grid[k] <= f.cells(k))) return false;
    // How the point moves with b1 and b2: it stays on the surface
    const Triple& g = out.jet.gradient;
    Triple moved[2];
    for (int i = 0; i < 2; ++i) {
        Triple step;
        for (int k = 0; k < 3; ++k)
            step[k] = patch.point[i + 1][k] - static_cast<double>(patch.point[0][k]) +
                      way * (patch.gradient[i + 1][k] - static_cast<double>(patch.gradient[0][k]));
        const double by = -dot(g, step) / dot(g, along);
        for (int k = 0; k < 3; ++k) moved[i][k] = step[k] + by * along[k];
    }
    double side = 0.0, square = 0.0, world[2][3], normal[3], place[3];
    for (int k = 0; k < 3; ++k) {
        const int a = (k + 1) % 3, b = (k + 2) % 3;
        side += g[k] * (moved[0][a] * moved[1][b] - moved[0][b] * moved[1][a]);
    }
    for (int i = 0; i < 2; ++i) f.vector_in_world(moved[i], world[i]);
    f.gradient_in_world(g, normal);
    f.place_in_world(out.grid, place);
    for (int k = 0; k < 3; ++k) {
        const int a = (k + 1) % 3, b = (k + 2) % 3;
        const double across = world[0][a] * world[1][b] - world[0][b] * world[1][a];
        square += across * across;
    }
    const double slope = std::sqrt(dot(normal, normal)), area = 0.5 * std::sqrt(square);
    if (!(slope > 0.0)) return false;
    for (int k = 0; k < 3; ++k) {
        out.position[k] = static_cast<float>(place[k]);
        out.normal[k] = static_cast<float>(normal[k] / slope);
    }
    out.slope = static_cast<float>(slope);
    out.area = static_cast<float>(side < 0.0 ? -area : area);
    return true;
}

bool tangent_ray(const FieldView& f, const PatchPoint& at, const float (&along)[3], float& curvature,
                 float& contact) {
    Triple v;
    f.vector_in_grid(along, v);
    const auto& h = at.jet.hessian;
    const double bent = h[0] * v[0] * v[0] + h[1] * v[1] * v[1] + h[2] * v[2] * v[2] +
                        2.0 * (h[3] * v[1] * v[2] + h[4] * v[0] * v[2] + h[5] * v[0] * v[1]);
    curvature = static_cast<float>(bent / at.slope);
    if (!(bent > 0.0) && !f.inside) return false;
    return touches_outside(f, at.grid, v, contact, bent > 0.0 ? 1.0 : -1.0);
}

TangentCurvatures tangent_curvatures(const FieldView& f, const PatchPoint& at, const float (&a)[3],
                                     const float (&b)[3]) {
    Triple u, v, bent_u, bent_v;
    f.vector_in_grid(a, u), f.vector_in_grid(b, v);
    times(at.jet.hessian, u, bent_u), times(at.jet.hessian, v, bent_v);
    const double inverse = 1.0 / at.slope;
    return {static_cast<float>(dot(u, bent_u) * inverse), static_cast<float>(dot(v, bent_v) * inverse),
            static_cast<float>(dot(u, bent_v) * inverse)};
}

}  // namespace edgegrad
