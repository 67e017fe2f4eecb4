// Light of a recorded emitter sample as a function of the scene.
//
// In material form a sample is a fixed point of its light: barycentrics of a face, coordinates in the frame
// of a light's shape, or coordinates in the cone of directions to a sun or a sphere
// (boundary/segment/light_motion.h lists them). It moves with the light, and so does the measure on the
// light,
//   L_e |w . M| / r^2,   M the area normal of the parametrisation.
// This is divided by its own value, since the sample's density is a constant.
#pragma once

#include "adjoint/segment_block.h"
#include "shading/emission.h"
#include "shading/lights/light_rows.h"

namespace edgegrad::EDGEGRAD_ISA {

// a divided by its own value: 1, with the derivative of log a. Where a is 0 the derivative is 0.
EG_INLINE Float relative(Float a) {
    const Float value = detach(a);
    return select(abs(value) > 1e-37f, a / select(abs(value) > 1e-37f, value, splat(1.0f)), splat(1.0f));
}

struct LightArrival {
    Vec3 w, radiance;
    Float measure;  // relative to its value
};

// Light of a face of a mesh.
EG_INLINE LightArrival light_of_face(const SceneView& scene, Mask active, const Triangle& t, Int face,
                                     Float b1, Float b2, Vec3 x, const FarMotion& motion) {
    const Segment segment = segment_to(x, t, b1.value, b2.value, motion);
    LightArrival a;
    a.w = segment.w, a.measure = segment.measure;
    if (!scene.emission_varies) {
        // The emission of the material's only closure, equal at all points and in all directions.
        const Int material = gather(scene.face_material, select(active, face, splat(0)));
        Float emission[3];
        gather_row(scene.closure_params + kEmission, kMaterialParams,
                   gather(scene.material_first_closure, material), emission);
        a.radiance = {emission[0], emission[1], emission[2]};
        return a;
    }
    const SurfacePoint s = surface_point(scene, active, face, b1, b2, a.w);
    const RayHistory history = ray_history(scene, splat(-1), s.position - x);
    a.radiance = emitted_radiance(scene, s, texture_point(scene, s, -a.w, splat(kNoRay), history));
    return a;
}

// Light of a row of the light table. `offset` is the vector from x to the sample, or the direction of a
// distant light.
EG_INLINE LightArrival light_of_row(const SceneView& scene, Mask active, Int row, Int kind, Vec3 offset,
                                    Vec3 x) {
    const LightRow l = gather_light(scene.lights, select(active, row, splat(0)));
    const auto is = [&](LightKind k) { return active & (kind == splat(k)); };
    // `place` is relative to the light's centre.
    const Vec3 center = detach(l.position), place = detach(x) + offset - center;
    // Find the position y and the area normal m of shapes in material form
    Vec3 y = l.position, m = zero3();
    const Mask without_size = is(kPointSource);
    const Mask sphere = is(kSphereLight), disk = is(kDiskLight);
    const Mask flat = is(kRectangleLight) | is(kEllipseLight);
    if (any(disk)) {
        const Vec3 axis = unit_vector(l.position - x);
        Vec3 a, b;
        basis(axis, a, b);
        const Float inverse = 1.0f / max(detach(l.radius), 1e-30f);
        const Float s = dot(place, detach(a)) * inverse, t = dot(place, detach(b)) * inverse;
        y = select(disk, l.position + (a * s + b * t) * l.radius, y);
        m = select(disk, axis * (l.radius * l.radius), m);
    }
    if (any(flat)) {
        const Vec3 ax = detach(l.axis_x), ay = detach(l.axis_y);
        const Float s = dot(place, ax) / max(dot(ax, ax), 1e-37f),
                    t = dot(place, ay) / max(dot(ay, ay), 1e-37f);
        y = select(flat, l.position + l.axis_x * s + l.axis_y * t, y);
        m = select(flat, cross(l.axis_x, l.axis_y), m);
    }
    // Differentiate the segment to y
    LightArrival a;
    const Segment segment = segment_to(x, y, m, without_size);
    a.w = segment.w, a.measure = segment.measure;
    Float r = splat(1.0f);  // for lights that decay with it
    if (any(active & ((l.flags & static_cast<int>(kLightDecay)) != 0))) {
        const Vec3 way = y - x;
        r = sqrt(max(dot(way, way), 1e-37f));
    }
    const Mask direction = is(kDirectionLight), cone = is(kConeLight) | sphere;
    a.w = select(direction, -l.direction, a.w);
    // Differentiate directions within cones
    if (any(cone)) {
        // A point of a cone of directions: that of a sun, or of a sphere as seen from x.
        Vec3 axis = -l.direction, way = offset;
        Float cap = l.one_minus_cos;
        if (any(sphere)) {
            const SphereCone round = sphere_cone(l.position - x, l.radius);
            axis = select(sphere, round.axis, axis);
            cap = select(sphere, round.cap, cap);
            way = select(sphere, unit_vector(offset), way);
        }
        Vec3 a1, a2;
        basis(axis, a1, a2);
        const Float s = dot(way, detach(a1)), t = dot(way, detach(a2)), c = dot(way, detach(axis));
        const Float rise = cap * (rise_from_axis(s * s + t * t, c) / max(detach(cap), 1e-30f));
        const Float turn = relative(sqrt(max(rise * (2.0f - rise), 0.0f)));
        a.w = select(cone, (a1 * s + a2 * t) * turn + axis * (1.0f - rise), a.w);
        a.measure = select(cone, relative(cap), a.measure);
        const Mask round = sphere & ((l.flags & static_cast<int>(kLightDecay)) != 0);
        if (any(round)) r = select(round, distance_in_cone(l.position - x, l.radius, a.w), r);
    }
    a.measure = select(direction, splat(1.0f), a.measure);
    a.radiance = l.radiance * light_factor(l, a.w, r);
    return a;
}

}  // namespace edgegrad::EDGEGRAD_ISA
