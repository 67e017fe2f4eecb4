#include "sdf/crossing_point.h"

#include <algorithm>
#include <cmath>

#include "sdf/outline_point.h"

namespace edgegrad {
namespace {

// Newton's method stops at steps of so many cells, and fails after so many steps or so far from its start.
constexpr double kResolved = 1e-9, kFar = 1.5;
constexpr int kMostSteps = 20;
// The surface is looked for over so many cells before a point of it.
constexpr double kContactCells = 0.125;

Vector in_grid(const FieldView& f, Vector d) {
    const double v[3] = {d.x, d.y, d.z};
    double grid[3];
    f.vector_in_grid(v, grid);
    return {grid[0], grid[1], grid[2]};
}

void place(const FieldView& f, Vector p, double (&grid)[3]) {
    const double at[3] = {p.x, p.y, p.z};
    f.place_in_grid(at, grid);
}

bool within(const FieldView& f, Vector p) {
    double grid[3];
    place(f, p, grid);
    for (int a = 0; a < 3; ++a)
        if (!(grid[a] >= 0.0 && grid[a] <= f.cells(a))) return false;
    return true;
}

// A length in cells: the least number of them among the fields. 0 for two planes, on which one step
// converges.
double cells(const CrossedSurface (&surfaces)[2], Vector d) {
    if (!surfaces[0].field && !surfaces[1].field) return 0.0;
    double least = 1e300;
    for (const CrossedSurface& s : surfaces)
        if (s.field) least = std::min(least, length(in_grid(*s.field, d)));
    return least;
}

struct Height {
    double height;
    Vector normal;
};

bool height_over(const CrossedSurface& s, Vector p, Height& out) {
    if (!s.field) {
        out = {dot(s.normal, p - s.point), s.normal};
        return true;
    }
    double grid[3];
    place(*s.field, p, grid);
    const SplineJet jet = spline_jet(*s.field, grid);
    double gradient[3];
    s.field->gradient_in_world(jet.gradient, gradient);
    const Vector g = {gradient[0], gradient[1], gradient[2]};
    const double slope = length(g);
    if (!(slope > 0.0)) return false;
    out = {jet.value / slope, g * (1.0 / slope)};
    return true;
}

bool heights_over(const CrossedSurface (&surfaces)[2], Vector p, Height (&out)[2]) {
    for (int k = 0; k < 2; ++k)
        if (!height_over(surfaces[k], p, out[k])) return false;
    return true;
}

bool both_hold(const CrossedSurface (&surfaces)[2], Vector p) {
    return std::all_of(surfaces, surfaces + 2,
                       [&](const CrossedSurface& s) { return !s.field || within(*s.field, p); });
}

}  // namespace

Vector unit_normal(const CrossedSurface& surface, Vector at) {
    Height h;
    return height_over(surface, at, h) ? h.normal : Vector{};
}

bool pull_to_crossing(const CrossedSurface (&surfaces)[2], Vector& point) {
    const Vector start = point;
    for (int step = 0; step < kMostSteps; ++step) {
        Height h[2];
        if (!heights_over(surfaces, point, h)) return false;
        const double cosine = dot(h[0].normal, h[1].normal), sine2 = 1.0 - cosine * cosine;
        if (!(sine2 > kCrossingParallel)) return false;
        const Vector d = h[0].normal * ((cosine * h[1].height - h[0].height) / sine2) +
                         h[1].normal * ((cosine * h[0].height - h[1].height) / sine2);
        point = point + d;
        if (!(cells(surfaces, point - start) < kFar)) return false;
        if (cells(surfaces, d) < kResolved) return both_hold(surfaces, point);
    }
    return false;
}

bool pull_along_line(const FieldView& field, Vector from, Vector way, double& part) {
    const CrossedSurface surface = crossed_field(field);
    const double start = part, step_cells = length(in_grid(field, way));
    for (int step = 0; step < kMostSteps; ++step) {
        Height h;
        if (!height_over(surface, from + way * part, h)) return false;
        const double by = -h.height / dot(h.normal, way);
        part += by;
        if (!(std::abs(part - start) * step_cells < kFar)) return false;
        if (std::abs(by) * step_cells < kResolved) return within(field, from + way * part);
    }
    return false;
}

bool crossing_point(const CrossedSurface (&surfaces)[2], const float (&a)[3], const float (&b)[3], float u,
                    CrossingPoint& out) {
    const Vector from = {a[0], a[1], a[2]}, way = Vector{b[0], b[1], b[2]} - from,
                 start = from + way * static_cast<double>(u);
    Vector at = start;
    Height h[2];
    // Solve both equations and that of the plane by Cramer's rule
    for (int step = 0;; ++step) {
        if (step == kMostSteps || !heights_over(surfaces, at, h)) return false;
        const Vector tangent = cross(h[0].normal, h[1].normal);
        const double det = dot(tangent, way);
        if (!(std::abs(det) > 0.0)) return false;
        const Vector d = (cross(h[1].normal, way) * h[0].height + cross(way, h[0].normal) * h[1].height +
                          tangent * dot(way, at - start)) *
                         (-1.0 / det);
        at = at + d;
        if (!(cells(surfaces, at - start) < kFar)) return false;
        if (cells(surfaces, d) < kResolved) break;
    }
    if (!both_hold(surfaces, at) || !heights_over(surfaces, at, h)) return false;
    const Vector tangent = cross(h[0].normal, h[1].normal);
    if (!(dot(tangent, tangent) > kCrossingParallel)) return false;
    const double along = dot(tangent, way);
    out = {at, {h[0].normal, h[1].normal}, tangent * (dot(way, way) / along), along < 0.0};
    return true;
}

bool meets_first(const FieldView& field, Vector point, Vector normal, Vector ray, float& contact) {
    const double step = kContactCells / std::max(length(in_grid(field, ray)), 1e-30);
    contact = static_cast<float>(step);
    const Vector before = point - ray * step;
    if (!within(field, before)) return true;
    double grid[3];
    place(field, before, grid);
    return spline_value(field, grid) * dot(normal, ray) < 0.0;
}

}  // namespace edgegrad
