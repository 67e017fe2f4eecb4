// Light at the end x of a chain of mirrors and glass. A point y is sampled on a light or on a surface that
// scatters light, or a direction to the environment. It is fixed while x moves.
//
// y is a fixed point in the frame of its light, as in the interior term (adjoint/light_arrival.h). With dM
// the measure of these points
//   L(x) = int f |n_s . w| V(x, y) L_e |n_y . w|/|y - x|^2 dM(y).
// For distant light dM is the solid angle and the geometry factor is 1. For surfaces L_e is the radiance
// scattered towards x. With y fixed, only V is discontinuous as x moves along a scan line or as the scene
// moves.
#pragma once

#include "boundary/segment/camera_subpath.h"
#include "boundary/segment/light_motion.h"
#include "boundary/segment/receiver.h"
#include "boundary/segment/segment.h"
#include "boundary/specular/chain_surface.h"
#include "shading/lights/environment_samples.h"
#include "shading/lights/light_radiance.h"
#include "shading/lights/lights.h"

namespace edgegrad::EDGEGRAD_ISA {

struct ChainLight {
    Int row, kind;       // of the light table, LightKind; -1: none
    Int face, instance;  // a face that emits or scatters; -1: none. Neither row nor face: environment
    Mask scatters;       // the face's light is what it scatters, not its emission
    Float b1, b2;        // place on the face
    // y. For distant light the direction to it. For disks that face x and for spheres, two coordinates (see
    // see_chain_light).
    Vec3 place;
    Int blockers, visible_to;
    Float density;  // of y with respect to dM

    EG_INLINE Mask is(LightKind k) const { return (row >= 0) & (kind == splat(k)); }
    EG_INLINE Mask environment() const { return (row < 0) & (face < 0); }
    EG_INLINE Mask distant() const { return environment() | ((row >= 0) & (kind >= splat(kDirectionLight))); }
};

EG_INLINE ChainLight no_chain_light() {
    const Int none = splat(-1);
    const Float zero = splat(0.0f);
    return {none,     splat(0), none,       none, splat(0), zero, zero, {zero, zero, splat(1.0f)},
            splat(0), splat(0), splat(1.0f)};
}

EG_INLINE ChainLight select(Mask m, const ChainLight& a, const ChainLight& b) {
    return {select(m, a.row, b.row),
            select(m, a.kind, b.kind),
            select(m, a.face, b.face),
            select(m, a.instance, b.instance),
            select(m, a.scatters, b.scatters),
            select(m, a.b1, b.b1),
            select(m, a.b2, b.b2),
            select(m, a.place, b.place),
            select(m, a.blockers, b.blockers),
            select(m, a.visible_to, b.visible_to),
            select(m, a.density, b.density)};
}

// A light as seen from x.
struct ChainLightRay {
    Vec3 w;          // unit, to y
    Float distance;  // infinite for distant light
    Float measure;   // |n_y . w|/|y - x|^2
};

EG_INLINE ChainLightRay see_chain_light(const SceneView& scene, Mask active, const ChainLight& light,
                                        Vec3 x) {
    LightRow l{};
    const Mask on_row = active & (light.row >= 0);
    if (any(on_row)) l = gather_light(scene.lights, select(on_row, light.row, splat(0)));
    Vec3 y = light.place, normal = zero3();
    // Find the point and the light's normal
    const Mask disk = on_row & light.is(kDiskLight);
    if (any(disk)) {
        const Vec3 axis = unit_vector(l.position - x);
        Vec3 a, b;
        basis(axis, a, b);
        y = select(disk, l.position + a * light.place.x + b * light.place.y, y);
        normal = select(disk, axis, normal);
    }
    normal = select(on_row & (light.is(kRectangleLight) | light.is(kEllipseLight)), l.direction, normal);
    const Mask on_face = active & (light.face >= 0);
    if (any(on_face)) {
        const Int face = select(on_face, light.face, splat(0));
        Triangle t = placed_triangle(scene, face, select(on_face, light.instance, splat(-1))).triangle;
        Float b1 = light.b1, b2 = light.b2;
        settle_on_fields(scene, on_face, face, t, b1, b2);
        const Vec3 m = area_normal(t);
        normal = select(on_face, m * (1.0f / max(sqrt(dot(m, m)), 1e-37f)), normal);
    }
    // Measure the ray to it
    const Mask distant = light.distant();
    const Vec3 way = select(distant, light.place, y - x);
    const Float r2 = max(dot(way, way), 1e-30f), r = sqrt(r2);
    ChainLightRay seen;
    seen.w = way * (1.0f / r);
    seen.distance = select(distant, splat(__builtin_inff()), r);
    const Float facing = select(on_row & light.is(kPointSource), splat(1.0f), abs(dot(normal, seen.w)));
    seen.measure = select(distant, splat(1.0f), facing / r2);
    const Mask sphere = on_row & light.is(kSphereLight);
    if (any(sphere)) {
        // The radius of `place` in the unit disk is the square root of the fraction of the cone inside that
        // direction.
        const Vec3 center = l.position - x;
        const SphereCone cone = sphere_cone(center, l.radius);
        Vec3 a, b;
        basis(cone.axis, a, b);
        const Float along = light.place.x, across = light.place.y;
        const Float rise = (along * along + across * across) * cone.cap;
        const Float sine = sqrt(cone.cap * (2.0f - rise));  // by the radius
        const Vec3 w = (a * along + b * across) * sine + cone.axis * (1.0f - rise);
        seen.w = select(sphere, w, seen.w);
        seen.distance = select(sphere, distance_in_cone(center, l.radius, w), seen.distance);
        seen.measure = select(sphere, cone.cap, seen.measure);
    }
    return seen;
}

// The radiance towards x on `mesh`. The choice of the light has respected its limit of bounces. It is 1 for
// surfaces that scatter; their radiance is estimated by paths.
EG_INLINE Vec3 radiance_of(const SceneView& scene, Mask active, const ChainLight& light,
                           const ChainLightRay& seen, Int mesh) {
    Vec3 radiance = select(active & light.scatters, one3(), zero3());
    const Mask environment = active & light.environment();
    if (any(environment)) radiance = select(environment, environment_radiance(scene, seen.w), radiance);
    const Mask on_row = active & (light.row >= 0) & shines_on(scene, light.row, mesh, splat(0));
    if (any(on_row)) {
        const LightRow l = gather_light(scene.lights, select(on_row, light.row, splat(0)));
        const Mask flat = light.is(kRectangleLight) | light.is(kEllipseLight);
        const Mask towards = on_row & (~flat | (dot(l.direction, seen.w) < 0.0f));
        radiance = select(towards, l.radiance * light_factor(l, seen.w, seen.distance), radiance);
    }
    const Mask on_face = active & (light.face >= 0) & ~light.scatters;
    if (!any(on_face)) return radiance;
    const Int face = select(on_face, light.face, splat(0));
    const Int material = gather(scene.face_material, face);
    const Mask front = dot(area_normal(gather_triangle(scene, face)), seen.w) < 0.0f;
    LightSample s{};
    s.active = on_face & (front | (gather(scene.emission_two_sided, material) != 0));
    s.face = light.face, s.b1 = light.b1, s.b2 = light.b2;
    s.w = seen.w;
    s.radiance = gather3(scene.emission, material);
    look_up_emission(scene, s);
    return select(s.active, s.radiance, radiance);
}

// The surface at which a chain ends, prepared for evaluation of its BSDF.
EG_INLINE ScatteringPoint scattering_point(const SceneView& scene, Mask active, const ChainSurface& s) {
    ScatteringPoint p{s.x, s.point, s.shader, s.point.normal, splat(0)};
    p.x.active = active;
    p.normal = shading_normal(scene, active, s.shader, s.point);
    p.both_sides = scatters_on_both_sides(s.shader);
    return p;
}

// The fraction of samples that an importance-sampled environment image takes. The others sample the BSDF.
constexpr float kByImage = 0.5f;

// Samples a direction to the environment by the BSDF of x or by the environment's image.
EG_OUTLINE Mask choose_environment(const SceneView& scene, const ScatteringPoint& x, Mask active,
                                   const Float (&random)[4], ChainLight& light) {
    const BsdfSample s = x.sample(scene, active, random[0], random[1], random[2]);
    Mask found = active & s.active & ~s.specular & (s.pdf > 0.0f);
    Vec3 w = s.wi;
    Float density = s.pdf;
    if (scene.environment_image.sampled) {
        const Mask by_image = active & (random[3] < kByImage);
        const EnvironmentSample e = sample_environment(scene, active, random[1], random[2]);
        found = select(by_image, e.pdf > 0.0f, found) & active;
        w = select(by_image, e.w, w);
        density = (1.0f - kByImage) * x.density(scene, found, w) + kByImage * environment_pdf(scene, w);
    }
    found &= (x.both_sides | (dot(x.x.normal, w) > 0.0f)) & (density > 0.0f);
    light.row = select(found, splat(-1), light.row), light.face = select(found, splat(-1), light.face);
    light.place = select(found, w, light.place);
    light.blockers = select(found, environment_blockers(scene), light.blockers);
    light.visible_to = select(found, splat(scene.environment_mask), light.visible_to);
    light.density = select(found, density, light.density);
    return found;
}

// Samples the BSDF of x for a surface. If there are several behind transparent ones, one is chosen at random.
EG_OUTLINE Mask choose_surface(const SceneView& scene, const ScatteringPoint& x, Mask active, UInt stream,
                               const Float (&random)[4], ChainLight& light) {
    const BsdfSample s = x.sample(scene, active, random[0], random[1], random[2]);
    Mask found = active & s.active & ~s.specular & (s.pdf > 0.0f);
    const Vec3 start = leave_surface(x.x, s.wi);
    PathIndex index;
    index.pixel = splat(0);
    index.sample = bits(splat(0));
    index.stream = hash(stream ^ splat(0x3c6ef372u));
    const Int all = splat(kScatteredRays);
    const ReceiverHit y =
        find_receiver(scene, found, start, -s.wi, ignore_nothing(), {all, all, kDiffuseRay, splat(0)}, index);
    found &= y.found;
    Float density = s.pdf;
    if (scene.all_flags & kHasTransparency) {
        // `y.through` contains transmittance over the probability of the choice. The transmittance is
        // evaluated again with the light, so only the probability enters the density here.
        const Vec3 through =
            transmittance(scene, found, start, s.wi, y.hit.distance * 0.9999f, {all, kDiffuseRay});
        found &= largest_component(through) > 0.0f;
        density = density * (largest_component(through) / max(largest_component(y.through), 1e-30f));
    }
    if (!any(found)) return found;
    ChainLight at = no_chain_light();
    at.face = select(found, y.hit.face, splat(0)), at.instance = select(found, y.hit.instance, splat(-1));
    at.b1 = y.hit.b1, at.b2 = y.hit.b2;
    at.scatters = found;
    at.place = hit_position(scene, found, y.hit, placed_triangle(scene, at.face, at.instance));
    at.blockers = at.visible_to = all;
    at.density = density * see_chain_light(scene, found, at, x.x.position).measure;
    found &= at.density > 0.0f;
    light = select(found, at, light);
    return found;
}

// Relative probabilities of the available kinds of light.
constexpr float kLightShare = 2.0f, kEnvironmentShare = 2.0f, kSurfaceShare = 1.0f;

// Samples a light for x with the picture's samplers. Returns the lanes that found one.
EG_OUTLINE Mask choose_chain_light(const SceneView& scene, const ScatteringPoint& x, Mask by_lights,
                                   Mask by_surfaces, Int bounces, UInt stream, const Float (&random)[4],
                                   Float pick, ChainLight& light) {
    light = no_chain_light();
    const bool lights = scene.lights.count > 0, environment = scene.has_environment;
    // Choose the kind of light
    const Float of_lights = select(by_lights, splat(lights ? kLightShare : 0.0f), 0.0f);
    const Float of_environment = select(by_lights, splat(environment ? kEnvironmentShare : 0.0f), 0.0f);
    const Float of_surfaces = select(by_surfaces, splat(kSurfaceShare), 0.0f);
    const Float all = of_lights + of_environment + of_surfaces, mark = pick * all;
    const Mask by_light = mark < of_lights, by_environment = ~by_light & (mark < of_lights + of_environment);
    const Mask by_surface = ~by_light & ~by_environment & (of_surfaces > 0.0f);
    Mask found = splat(0);
    // Sample a light and express the point in the light's frame
    if (any(by_light)) {
        const LightSample s = sample_light(scene, by_light, x.x, x.both_sides, bounces, random[0], random[1]);
        const Mask at = by_light & s.active & s.casts_shadow;
        light.row = s.row, light.kind = s.kind, light.face = s.face;
        light.b1 = s.b1, light.b2 = s.b2;
        light.place = select(s.distant, s.w, x.x.position + s.w * s.r);
        light.blockers = s.blockers, light.visible_to = s.visible_to;
        const Mask disk = at & light.is(kDiskLight);
        if (any(disk)) {
            const LightRow l = gather_light(scene.lights, select(disk, s.row, splat(0)));
            Vec3 a, b;
            basis(unit_vector(l.position - x.x.position), a, b);
            const Vec3 across = light.place - l.position;
            light.place = select(disk, {dot(across, a), dot(across, b), splat(0.0f)}, light.place);
        }
        const Mask sphere = at & light.is(kSphereLight);
        if (any(sphere)) {
            const LightRow l = gather_light(scene.lights, select(sphere, s.row, splat(0)));
            const SphereCone cone = sphere_cone(l.position - x.x.position, l.radius);
            Vec3 a, b;
            basis(cone.axis, a, b);
            const Float along = dot(s.w, a), across = dot(s.w, b);
            const Float sine2 = max(along * along + across * across, 1e-37f);
            const Float rise = rise_from_axis(sine2, dot(s.w, cone.axis));
            const Float scale = sqrt(min(rise / max(cone.cap, 1e-30f), splat(1.0f)) / sine2);
            light.place = select(sphere, {along * scale, across * scale, splat(0.0f)}, light.place);
        }
        // s.geometry is the measure of the sampled point, as seen from x, over its density.
        const ChainLightRay seen = see_chain_light(scene, at, light, x.x.position);
        light.density = select(light.distant(), splat(1.0f), seen.measure) / max(s.geometry, 1e-37f);
        found |= at & (light.density > 0.0f);
    }
    // Sample the environment or a surface
    if (any(by_environment)) found |= choose_environment(scene, x, by_environment, random, light);
    if (any(by_surface)) found |= choose_surface(scene, x, by_surface, stream, random, light);
    const Float share = select(by_light, of_lights, select(by_environment, of_environment, of_surfaces));
    light.density = light.density * (share / max(all, 1e-30f));
    return found;
}

// What the light moves with.
EG_INLINE FarEnd far_end(const SceneView& scene, const ChainLight& light) {
    FarEnd y = still_far_end();
    y.face = light.face, y.instance = light.instance, y.b1 = light.b1, y.b2 = light.b2;
    y.row = light.row, y.kind = light.kind;
    y.environment = light.environment() & turns_with_environment(scene);
    return y;
}

}  // namespace edgegrad::EDGEGRAD_ISA
