// The outlines of lights of the light table that the camera sees (derivations, D).
//
// Such lights occlude nothing, so the jump across an outline is their own radiance L, where visible. With
// y(u) a point of the outline, t = dy/du, D the direction of the camera's ray through y, kappa the picture's
// area per area perpendicular to D, and c the velocity of that ray (boundary/terms/primary.h),
//   dI = int du  L kappa N . (dy - c),    N = D x t, away from the light's centre.
// A sphere's outline is where rays touch it, n . D = 0. N is then parallel to n, and y moves like a point of
// the surface. A disk faces the ray's origin and turns with it. Parallel rays have different origins: a ray
// meets the disk that faces its origin if it passes the centre within the distance rho. With R the disk's
// radius and h the depth of its centre,
//   rho^2 (1 + rho^2/h^2) = R^2.
// The outline of a sun is a circle of directions. y is then a far point on the ray along such a direction,
// and moves with the ray's origin, so that only dy - c matters.
//
// u is uniform on the sampled segment of the outline.
#pragma once

#include "boundary/samples/direct_samples.h"
#include "boundary/segment/light_motion.h"
#include "path/lens_sample.h"
#include "reparameterisation/camera_blocks.h"
#include "shading/transmittance.h"
#include "tasks/boundary_task.h"

namespace edgegrad::EDGEGRAD_ISA {

struct OutlinePoint {
    Mask active;
    Vec3 y, t;  // y(u) and dy/du
    Vec3 out;   // away from the light's centre
};

struct OutlineSample {
    Mask active;
    Int row, kind;
    Vec3 point, normal;  // y, N
    Float weight;        // kappa over the density of the sample
    Projection view;
    Vec3 color;  // L
};

EG_INLINE Mask is_sun(Int kind) { return kind == splat(kConeLight); }

// The radius of the outline of a disk for parallel rays, and its derivatives.
struct ParallelDisk {
    Float rho, by_radius, by_depth;
};
EG_INLINE ParallelDisk parallel_disk(Float radius, Float depth) {
    const Float share = radius / max(abs(depth), 1e-30f);
    const Float root = sqrt(1.0f + 4.0f * share * share), factor = sqrt(2.0f / (1.0f + root));
    const Float sine = share * factor;  // rho/h
    const Float slope = 1.0f / (1.0f + 2.0f * sine * sine);
    return {radius * factor, slope / factor, sine * sine * sine * slope};
}

// The point of the outline at u, as seen from the ray's origin, or along its direction if rays are parallel.
EG_INLINE OutlinePoint outline_point(const LightRow& l, Int kind, Float u, Vec3 origin, Vec3 direction,
                                     bool parallel) {
    constexpr float kTurn = 6.28318531f;
    const auto is = [&](LightKind k) { return kind == splat(k); };
    Float s, c;
    sincos_turn(u, s, c);
    const Vec3 way = l.position - origin;
    const Float distance = sqrt(max(dot(way, way), 1e-30f));
    const Vec3 axis = parallel ? direction : way * (1.0f / distance);
    Vec3 a, b;
    basis(axis, a, b);
    // For a sphere, the circle is in front of the centre and smaller than a great circle.
    const Float sine = select(is(kSphereLight) & splat(parallel ? 0 : -1), l.radius / distance, splat(0.0f));
    const Float cosine = sqrt(max(1.0f - sine * sine, 0.0f));
    Vec3 center = l.position - axis * (l.radius * sine);
    Float radius = l.radius * cosine;
    if (parallel) radius = select(is(kDiskLight), parallel_disk(l.radius, distance).rho, radius);
    a = a * radius, b = b * radius;
    const Mask ellipse = is(kEllipseLight), flat = ellipse | is(kRectangleLight);
    center = select(flat, l.position, center);
    a = select(flat, l.axis_x, a), b = select(flat, l.axis_y, b);
    Vec3 y = center + a * c + b * s, t = (b * c - a * s) * splat(kTurn);
    if (any(is(kRectangleLight))) {
        // The four sides are (1, v), (-v, 1), (-1, -v), (v, -1) in the half axes, with v from -1 to 1.
        const Float side = floor(min(4.0f * u, splat(3.9999998f))), v = 8.0f * u - 2.0f * side - 1.0f;
        const Float cx = select(side == 0.0f, splat(1.0f), select(side == 2.0f, splat(-1.0f), splat(0.0f)));
        const Float cy = select(side == 1.0f, splat(1.0f), select(side == 3.0f, splat(-1.0f), splat(0.0f)));
        y = select(is(kRectangleLight), center + a * (cx - cy * v) + b * (cy + cx * v), y);
        t = select(is(kRectangleLight), (b * cx - a * cy) * splat(8.0f), t);
    }
    OutlinePoint out = {flat | (distance > l.radius) | splat(parallel ? -1 : 0), y, t, y - l.position};
    // A sun: place the point far along the direction
    const Mask sun = is_sun(kind);
    if (!any(sun)) return out;
    // Far enough that rounding of the point amounts to rounding of its direction.
    const Float far = 1.0f + 128.0f * largest_component(origin);
    const Vec3 middle = -l.direction;
    basis(middle, a, b);
    const Float cos = 1.0f - l.one_minus_cos;
    const Float sin = sqrt(max(l.one_minus_cos * (2.0f - l.one_minus_cos), 0.0f));
    const Vec3 e = a * c + b * s;
    out.active = select(sun, splat(parallel ? 0 : -1), out.active);
    out.y = select(sun, origin + (middle * cos + e * sin) * far, out.y);
    out.t = select(sun, (b * c - a * s) * (sin * far * kTurn), out.t);
    out.out = select(sun, e * cos - middle * sin, out.out);
    return out;
}

EG_OUTLINE OutlineSample sample_outline(const SceneView& scene, const BoundaryTask& task, int64_t at,
                                        SegmentCursor& cursor, const DerivativeView& motion, const float*) {
    OutlineSample s;
    const SegmentSample p = sample_edge_segment(scene, task, at, cursor);
    const CameraView& camera = scene.camera;
    s.row = p.light_row();
    s.color = zero3();
    s.kind = kind_of_rows(scene.lights, s.row);
    const LightRow l = gather_light(scene.lights, s.row);
    // Sample a point of the outline
    const LensPoint lens = lens_of(camera, p.random);
    const Projection middle = project(camera, l.position, lens);
    const Float u = min(p.u0 + (p.u1 - p.u0) * p.tau, splat(0.99999994f));
    const bool parallel = camera.kind == kOrthographic;
    const OutlinePoint at_u = outline_point(l, s.kind, u, middle.origin, middle.direction, parallel);
    s.active = p.active & at_u.active;
    s.point = at_u.y;
    if (!rays_move(motion) && !motion.lights_requested) s.active = splat(0);
    // Project the point and orient N
    s.view = project(camera, s.point, lens);
    s.active &= s.view.active & in_reach(camera, s.view.sx, s.view.sy);
    const Mask flat = (s.kind == splat(kRectangleLight)) | (s.kind == splat(kEllipseLight));
    s.active &= ~flat | (dot(s.view.direction, l.direction) < 0.0f);
    s.normal = cross(s.view.across_of, at_u.t);
    s.normal = select(dot(s.normal, at_u.out) < 0.0f, -s.normal, s.normal);
    s.weight = s.view.area * ((p.u1 - p.u0) * task.scale / p.density);
    if (!any(s.active)) return s;
    // Evaluate the transmittance of surfaces in front, within the clip distances. A sun is behind everything,
    // and its ray starts at the near clip distance. The opposite direction would miss surfaces by rounding.
    const Mask sun = is_sun(s.kind);
    Float distance = select(sun, s.view.far, s.view.distance);
    if (parallel) {
        // The disk that faces a parallel ray's origin is deeper than its centre by this distance.
        const Vec3 place = s.point - l.position;
        const Mask disk = s.kind == splat(kDiskLight);
        distance = select(disk, distance + dot(place, place) / max(distance, 1e-30f), distance);
    }
    const Float reach = min(distance, s.view.far);
    const Vec3 end = s.view.origin + s.view.direction * select(sun, s.view.near, reach);
    const Vec3 through =
        transmittance(scene, s.active & (reach > s.view.near), end,
                      select(sun, s.view.direction * (reach - s.view.near), s.view.origin - end),
                      select(sun, splat(1.0f), 1.0f - s.view.near / max(reach, 1e-30f)),
                      {splat(1 << kCameraRay), kCameraRay, task.limits.transparent});
    const Vec3 white = one3();
    s.color = l.radiance * light_factor(l, s.view.direction, distance) *
              select(reach > s.view.near, through, white);
    s.active &= largest_component(s.color) > 0.0f;
    return s;
}

// The row's adjoints for disks that meet parallel rays, with `g` the adjoint of the outline. Returns the
// adjoint of the centre by its depth.
EG_INLINE Vec3 parallel_disk_row(const SceneView& scene, const OutlineSample& s, Mask disk, Vec3 g,
                                 Float (&row)[kLightParams]) {
    const LightRow l = gather_light(scene.lights, s.row);
    const Vec3 place = s.point - l.position;
    const ParallelDisk d = parallel_disk(l.radius, s.view.parameter);
    const Float outwards = dot(g, place) / max(d.rho, 1e-30f);
    const Vec3 by_depth = s.view.direction * (outwards * d.by_depth), by_place = g + by_depth;
    set_three(row, kLightPosition, disk, by_place);
    row[kLightRadius] = select(disk, outwards * d.by_radius, row[kLightRadius]);
    return by_depth;
}

// Adds the camera's part of that depth, w . (p - o) with w = -Z. The rest of the adjoint is subtracted with
// the rays' velocity.
EG_INLINE void add_depth(const SceneView& scene, const OutlineSample& s, Mask disk, Vec3 by_depth,
                         Float (&ray)[kCameraFloats]) {
    const LightRow l = gather_light(scene.lights, s.row);
    const Vec3 way = l.position - splat3(scene.camera.position);
    const Vec3 back = way * dot(by_depth, s.view.direction);
    const auto add = [&](int at, Vec3 v) {
        ray[at] = ray[at] + select(disk, v.x, 0.0f), ray[at + 1] = ray[at + 1] + select(disk, v.y, 0.0f);
        ray[at + 2] = ray[at + 2] + select(disk, v.z, 0.0f);
    };
    add(kCameraPosition, by_depth);
    add(kCameraBack, back);
}

// Adds g . dy minus weight N . c, times the color, for the requested parameters.
template <typename Mode>
EG_INLINE void outline_blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                              const OutlineSample& s, Vec3 g) {
    // The light's parameters
    const Vec3 origin = s.view.origin;
    const Mask disk = s.active & (s.kind == splat(kDiskLight)), sun = is_sun(s.kind);
    const bool widens = scene.camera.kind == kOrthographic && any(disk);
    Float row[kLightParams];
    const Vec3 to_light = select(sun, g * s.view.distance, g);
    Vec3 from = light_motion_row(scene.lights, s.row, s.kind, origin,
                                 select(sun, s.view.direction, s.point - origin), to_light, row);
    from = select(sun, g, from);  // y moves with the ray's origin
    const Mask sphere = s.kind == splat(kSphereLight);
    if (any(sphere)) sphere_surface_row(scene.lights, sphere, s.row, s.point, g, row);
    Vec3 by_depth = zero3();
    if (widens) by_depth = parallel_disk_row(scene, s, disk, g, row);
    if (motion.lights_requested) mode.light(s.active, s.row, row, s.color);
    // The camera's parameters
    const Mask turns = (disk & splat(widens ? 0 : -1)) | (s.active & sun);
    Projection at_origin = s.view;
    at_origin.parameter = splat(0.0f);
    if (motion.warped) {
        warp_rays(mode, scene, s.active, s.view, s.normal * s.weight, -s.color);
        if (any(turns)) warp_rays(mode, scene, turns, at_origin, from, s.color);
    }
    if (!motion.camera_requested) return;
    Float ray[kCameraFloats];
    ray_velocity_row(scene.camera, s.view, s.normal * s.weight, ray);
    if (widens) add_depth(scene, s, disk, by_depth, ray);
    mode.camera(s.active, ray, -s.color);
    if (!any(turns)) return;
    ray_velocity_row(scene.camera, at_origin, from, ray);
    mode.camera(turns, ray, s.color);
}

template <typename Mode>
EG_INLINE void moving_blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                             const OutlineSample& s) {
    outline_blocks(mode, scene, motion, s, s.normal * s.weight);
}

// The swept area per unit of color, if the outline moves across the ray by one unit.
EG_INLINE Float sweep_of(const OutlineSample& s) { return s.weight * sqrt(dot(s.normal, s.normal)); }

// Drops samples of infinite size, and writes the sizes of a first pass.
EG_INLINE void weigh(const BoundaryTask& task, int64_t at, OutlineSample& s) {
    s.active = weigh_samples(task, at, s.active, splat(-1), splat(-1), size_of(s.color) * sweep_of(s));
}

}  // namespace edgegrad::EDGEGRAD_ISA
