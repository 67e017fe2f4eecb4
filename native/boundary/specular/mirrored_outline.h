// Outlines of lights of the table that are seen through chains of mirrors and smooth glass (derivations, J).
//
// The last ray of a chain leaves p along D. Lights of the table occlude nothing, so radiance jumps by that of
// the light, L, at the outline of its image,
//   g(s, theta) = 1 - rho = 0,
// where rho, at the place where the ray passes the light, is 1 on the light's outline and less inside. With y
// the place of the outline that the ray meets at the distance t, and q the gradient of rho there, along the
// light's plane of the normal n,
//   -dg/dtheta = a . (dp + t dD - dy),   a = q - n (q . D)/(n . D).
// For rectangles rho is the larger coordinate in units of half the extents, and for ellipses and disks the
// distance from the centre. Spheres and suns are cones of directions about the axis A, where rho is 1 - D . A
// over its value k on the outline:
//   -dg/dtheta = b . (dD - dw),   b = -(A - D (A . D))/k,
// with w the outline's direction. For spheres y = p + t w and a = b/t.
// dy and dw are the motions of fixed places of the light (boundary/segment/light_motion.h).
#pragma once

#include "boundary/segment/segment.h"
#include "boundary/specular/chain_horizon.h"
#include "shading/transmittance.h"

namespace edgegrad::EDGEGRAD_ISA {

// Crossings with outlines of lights.
EG_INLINE Mask at_light_outline(const ChainCrossings& c, int at, int count) {
    return first_lanes(count - at) & (load(c.outlined_light + at) >= 0);
}

// The light, and where the ray from p along the unit vector D meets its outline.
struct MetOutline {
    LightRow light;
    FarEnd y;
    Float distance;  // infinite for suns
    Float rho;       // where the ray passes the light
    Vec3 by_y;       // -dg/dy, or with respect to the direction to y for suns
};

EG_OUTLINE MetOutline met_outline(const SceneView& scene, Mask active, Int row, Vec3 p, Vec3 d) {
    MetOutline m;
    const Int at = select(active, row, splat(0));
    m.y = still_far_end();
    m.y.row = select(active, row, splat(-1));
    m.y.kind = kind_of_rows(scene.lights, m.y.row);
    const LightRow& l = m.light = gather_light(scene.lights, at);
    const auto is = [&](LightKind k) { return active & (m.y.kind == splat(k)); };
    const Vec3 center = l.position - p;
    const Mask sphere = is(kSphereLight), disk = is(kDiskLight), rectangle = is(kRectangleLight);
    const Mask sun = is(kConeLight), flat = active & ~(sphere | sun);
    m.distance = m.rho = splat(0.0f), m.by_y = zero3();
    if (any(flat)) {
        const Vec3 n = select(disk, center, l.direction);
        const Float facing = dot(d, n), inverse = 1.0f / select(abs(facing) > 1e-30f, facing, splat(1e-30f));
        m.distance = dot(center, n) * inverse;
        const Vec3 across = d * m.distance - center;
        const Float x2 = 1.0f / max(dot(l.axis_x, l.axis_x), 1e-37f),
                    y2 = 1.0f / max(dot(l.axis_y, l.axis_y), 1e-37f);
        const Float x = dot(across, l.axis_x) * x2, y = dot(across, l.axis_y) * y2;
        const Mask wide = abs(x) > abs(y);
        const Float side = select(select(wide, x, y) < 0.0f, splat(-1.0f), splat(1.0f));
        const Float radius = max(l.radius, 1e-30f), off = sqrt(dot(across, across)),
                    round = sqrt(x * x + y * y);
        m.rho = select(disk, off / radius, select(rectangle, max(abs(x), abs(y)), round));
        const Vec3 by_round = (l.axis_x * (x * x2) + l.axis_y * (y * y2)) * (1.0f / max(round, 1e-30f));
        const Vec3 by_side = select(wide, l.axis_x * x2, l.axis_y * y2) * side;
        const Vec3 q =
            select(disk, across * (1.0f / (radius * max(off, 1e-30f))), select(rectangle, by_side, by_round));
        m.by_y = n * (dot(q, d) * inverse) - q;
    }
    if (any(sphere | sun)) {
        const SphereCone cone = sphere_cone(center, l.radius);
        const Vec3 axis = select(sun, -l.direction, cone.axis), chord = d - axis;
        const Float cap = max(select(sun, l.one_minus_cos, cone.cap), 1e-30f);
        const Float way = select(sun, splat(__builtin_inff()), distance_in_cone(center, l.radius, d));
        m.distance = select(flat, m.distance, way);
        m.rho = select(flat, m.rho, 0.5f * dot(chord, chord) / cap);
        const Float scale = 1.0f / (cap * select(sun, splat(1.0f), way));
        m.by_y = select(flat, m.by_y, (axis - d * dot(axis, d)) * scale);
    }
    return m;
}

// Sets the slopes -dg of crossings with outlines of lights by the chain's last ray, and the jumps of
// radiance. `p` is the path that the ray continues. Returns the lanes that have a jump.
EG_OUTLINE Mask light_outline_jump(const SceneView& scene, const BoundaryTask& task, ChainCrossings& c,
                                   int at, Mask active, const ChainRay& ray, const PathPacket& p) {
    const Vec3 d = ray.direction;
    const MetOutline m = met_outline(scene, active, load(c.outlined_light + at), ray.from, d);
    const Mask distant = is_distant(m.y);
    const Float way = select(distant, splat(1.0f), m.distance);
    Float row[kLightParams];
    const Vec3 from = light_motion_row(scene.lights, select(active, m.y.row, splat(0)), m.y.kind, ray.from,
                                       d * way, m.by_y, row);
    put3(c.by_point, at, active, select(distant, zero3(), from - m.by_y));
    put3(c.by_direction, at, active, m.by_y * -way);
    put3(c.from, at, active, ray.from), put3(c.direction, at, active, d);
    // The light is inside of the outline, where g > 0
    const Float start = length_of(ray.origin - ray.from);
    const Vec3 seen = transmittance(scene, active, ray.origin, d,
                                    select(distant, splat(__builtin_inff()), (m.distance - start) * 0.9999f),
                                    {ray_mask(ray.kind), kGlossyRay, task.limits.transparent});
    const Float met =
        light_factor(m.light, d, way) * share_of_rays(ray.lobe, followed_for(scene, active, m.y.row));
    const Vec3 jump = m.light.radiance * met * seen * p.throughput;
    active &= (m.distance > start) & (largest_component(jump) > 0.0f);
    put3(c.jump, at, active, jump * -load(c.weight + at));
    return active;
}

// Adds the part of -dg that is due to the light's motion, times `color`, for the requested parameters.
template <typename Mode>
EG_INLINE void light_outline_blocks(Mode& mode, const SceneView& scene, const DerivativeView& requested,
                                    const ChainCrossings& c, int at, Mask active, Vec3 from, Vec3 color) {
    if (!any(active) || !requested.lights_requested) return;
    Vec3 d;
    load3(d, c.direction, at);
    const MetOutline m = met_outline(scene, active, load(c.outlined_light + at), from, d);
    far_end_blocks(mode, scene, requested, active, m.y, from, d, m.distance, m.by_y, color);
}

}  // namespace edgegrad::EDGEGRAD_ISA
