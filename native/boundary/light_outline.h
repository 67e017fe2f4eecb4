// The outlines of lights that the camera sees: rows of the light table with a size.
//
// Such lights hide nothing, so that what jumps across an outline is their own radiance L, where the camera
// sees it. With y(u) a point of the outline, t = dy/du, D the direction of the camera's ray through it, kappa
// the picture's area per area across D and c the velocity of that ray (boundary/primary.h):
//   dI = int du  L kappa N . (dy - c),    N = D x t, turned away from the light's centre.
// A sphere's outline is where rays touch it, n . D = 0: with N along n it moves as the sphere's points do. A
// disk that faces the ray's origin turns with it.
#pragma once

#include "boundary/direct_samples.h"
#include "boundary/light_motion.h"
#include "path/lens_sample.h"
#include "shading/transmittance.h"

namespace edgegrad::EDGEGRAD_ISA {

struct OutlineSample {
    Mask active;
    Int row, kind;
    Vec3 point, normal;  // y, N
    Float weight;        // kappa by the density of the sample
    Projection view;
    Vec3 color;  // L
};

// A point of the outline as seen from the ray's origin (or along its direction, where all are parallel), and
// its derivative by u.
EG_INLINE Mask outline_point(const LightRow& l, Int kind, Float u, Vec3 origin, Vec3 direction, bool parallel,
                             Vec3& y, Vec3& t) {
    constexpr float kTurn = 6.28318531f;
    const auto is = [&](LightKind k) { return kind == splat(static_cast<int>(k)); };
    Float s, c;
    sincos_turn(u, s, c);
    const Vec3 way = l.position - origin;
    const Float distance = sqrt(max(dot(way, way), 1e-30f));
    const Vec3 axis = parallel ? direction : way * (1.0f / distance);
    Vec3 a, b;
    basis(axis, a, b);
    // Of a sphere the circle is nearer than the centre, and smaller than a great one.
    const Float sine = select(is(kSphereLight) & splat(parallel ? 0 : -1), l.radius / distance, splat(0.0f));
    const Float cosine = sqrt(max(1.0f - sine * sine, 0.0f));
    Vec3 center = l.position - axis * (l.radius * sine);
    a = a * (l.radius * cosine), b = b * (l.radius * cosine);
    const Mask ellipse = is(kEllipseLight), flat = ellipse | is(kRectangleLight);
    center = select(flat, l.position, center);
    a = select(flat, l.axis_x, a), b = select(flat, l.axis_y, b);
    y = center + a * c + b * s;
    t = (b * c - a * s) * splat(kTurn);
    if (any(is(kRectangleLight))) {
        // Side by side: (1, v), (-v, 1), (-1, -v), (v, -1) in the half axes, v from -1 to 1.
        const Float side = floor(min(4.0f * u, splat(3.9999998f))), v = 8.0f * u - 2.0f * side - 1.0f;
        const Float cx = select(side == 0.0f, splat(1.0f), select(side == 2.0f, splat(-1.0f), splat(0.0f)));
        const Float cy = select(side == 1.0f, splat(1.0f), select(side == 3.0f, splat(-1.0f), splat(0.0f)));
        y = select(is(kRectangleLight), center + a * (cx - cy * v) + b * (cy + cx * v), y);
        t = select(is(kRectangleLight), (b * cx - a * cy) * splat(8.0f), t);
    }
    return flat | (distance > l.radius) | splat(parallel ? -1 : 0);
}

EG_OUTLINE OutlineSample sample_outline(const SceneView& scene, const BoundaryTask& task, int64_t at,
                                        PieceCursor& piece, const DerivativeView& asked, const float*) {
    OutlineSample s;
    const PieceSample p = sample_piece(scene, task, at, piece);
    const CameraView& camera = scene.camera;
    s.row = p.cell;
    s.color = zero3();
    s.kind = kind_of_rows(scene.lights, s.row);
    const LightRow l = gather_light(scene.lights, s.row);
    const LensPoint lens = lens_of(camera, p.random);
    const Projection middle = project(camera, l.position, lens);
    Vec3 t;
    const Float u = min(p.u0 + (p.u1 - p.u0) * p.tau, splat(0.99999994f));
    s.active = p.active & outline_point(l, s.kind, u, middle.origin, middle.direction,
                                        camera.kind == kOrthographic, s.point, t);
    if (!asked.want_camera && !asked.want_lights) s.active = splat(0);
    s.view = project(camera, s.point, lens);
    s.active &= s.view.active & in_reach(camera, s.view.sx, s.view.sy);
    const Mask flat = (s.kind == splat(static_cast<int>(kRectangleLight))) |
                      (s.kind == splat(static_cast<int>(kEllipseLight)));
    s.active &= ~flat | (dot(s.view.direction, l.direction) < 0.0f);
    s.normal = cross(s.view.across_of, t);
    s.normal = select(dot(s.normal, s.point - l.position) < 0.0f, -s.normal, s.normal);
    s.weight = s.view.area * ((p.u1 - p.u0) * task.scale / p.density);
    if (!any(s.active)) return s;
    // Surfaces in front of it, but for what the camera clips.
    const Float reach = min(s.view.distance, s.view.far);
    const Vec3 start = s.view.origin + s.view.direction * reach;
    const Vec3 through = transmittance(scene, s.active & (reach > s.view.near), start, s.view.origin - start,
                                       1.0f - s.view.near / max(reach, 1e-30f),
                                       {splat(1 << kCameraRay), kCameraRay, task.limits.transparent});
    const Vec3 white = {splat(1.0f), splat(1.0f), splat(1.0f)};
    s.color = l.radiance * light_factor(l, s.view.direction) * select(reach > s.view.near, through, white);
    s.active &= largest_component(s.color) > 0.0f;
    return s;
}

// g . dy less weight N . c, times the color, for what `asked` names.
template <typename Mode>
EG_INLINE void outline_blocks(Mode& mode, const SceneView& scene, const DerivativeView& asked,
                              const OutlineSample& s, Vec3 g) {
    const Vec3 origin = s.view.origin;
    Float row[kLightParams];
    const Vec3 from = light_motion_row(scene.lights, s.row, s.kind, origin, s.point - origin, g, row);
    if (asked.want_lights) mode.light(s.active, s.row, row, s.color);
    if (!asked.want_camera) return;
    Float ray[kCameraFloats];
    ray_velocity_row(scene.camera, s.view, s.normal * s.weight, ray);
    mode.camera(s.active, ray, -s.color);
    const Mask turns = s.active & (s.kind == splat(static_cast<int>(kDiskLight)));
    if (!any(turns)) return;
    Projection at_origin = s.view;
    at_origin.parameter = splat(0.0f);
    ray_velocity_row(scene.camera, at_origin, from, ray);
    mode.camera(turns, ray, s.color);
}

template <typename Mode>
EG_INLINE void moving_blocks(Mode& mode, const SceneView& scene, const DerivativeView& asked,
                             const OutlineSample& s) {
    outline_blocks(mode, scene, asked, s, s.normal * s.weight);
}

// What a motion of the outline across the ray sweeps, per unit and color.
EG_INLINE Float sweep_of(const OutlineSample& s) { return s.weight * sqrt(dot(s.normal, s.normal)); }

// Leaves out samples without a finite size, and writes the sizes of those of a first pass.
EG_INLINE void weigh(const BoundaryTask& task, int64_t at, OutlineSample& s) {
    const Float size = size_of(s.color) * sweep_of(s);
    s.active = keep_finite(task, at, s.active, splat(-1), splat(-1), size);
    if (!task.score) return;
    for (int i = 0; i < W && at + i < task.count; ++i)
        task.score[task.first + at + i] = s.active[i] ? size[i] : 0.0f;
}

}  // namespace edgegrad::EDGEGRAD_ISA
