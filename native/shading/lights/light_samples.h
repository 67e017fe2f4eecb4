// A sample of all lights except the environment (shading/lights/environment.h), for a point of a surface or
// of an edge.
#pragma once

#include "scene/rays/rays.h"
#include "shading/lights/light_choice.h"
#include "shading/lights/light_rows.h"

namespace edgegrad::EDGEGRAD_ISA {

struct LightSample {
    Mask active;
    Vec3 w;          // unit, towards the light
    Float r;         // distance; infinite for suns
    Vec3 radiance;   // arrives along w; of lights without size: intensity or irradiance
    Float share;     // share of the light that its cone or grid transmits
    Float geometry;  // factor of radiance * f |cos|: 1/pdf; without size 1/(r^2 P) or 1/P
    Float pdf;       // per solid angle, choice included; 0: no ray can meet a light without size
    Vec3 end;        // end of the shadow ray, offset from the light's own surface
    Mask distant;
    Mask casts_shadow;
    Int blockers;    // Embree's mask for shadow rays
    Int visible_to;  // bits 1 << RayKind: kinds of scattering for which the light is visible
    // Position on an emissive face (with the radiance of a constant emission); face -1: not on a face.
    Int face;
    Float b1, b2;
    Int row, kind;  // in the light table, -1: on a face; LightKind
};

EG_INLINE LightSample select(Mask m, const LightSample& a, const LightSample& b) {
    return {select(m, a.active, b.active),
            select(m, a.w, b.w),
            select(m, a.r, b.r),
            select(m, a.radiance, b.radiance),
            select(m, a.share, b.share),
            select(m, a.geometry, b.geometry),
            select(m, a.pdf, b.pdf),
            select(m, a.end, b.end),
            select(m, a.distant, b.distant),
            select(m, a.casts_shadow, b.casts_shadow),
            select(m, a.blockers, b.blockers),
            select(m, a.visible_to, b.visible_to),
            select(m, a.face, b.face),
            select(m, a.b1, b.b1),
            select(m, a.b2, b.b2),
            select(m, a.row, b.row),
            select(m, a.kind, b.kind)};
}

// A point of a surface as a receiver. Only light in front of it contributes, unless `both_sides` is set.
struct SurfaceReceiver : Receiver {
    Int face;

    static constexpr bool kOnSurface = true;
    EG_INLINE Mask owns(const SceneView&, Int emissive) const { return emissive == face; }
    EG_INLINE Mask faces(Vec3 w) const {
        const Mask above = both_sides | (dot(normal, w) > 0.0f);
        return shading ? above | (dot(*shading, w) > 0.0f) : above;
    }
};

// A point of an edge as a receiver, which surfaces on all sides may see. A disk light faces its receiver,
// which is not known yet, so the sphere around the disk is sampled instead.
struct TransparentEdge {
    Vec3 position;
    Int edge;

    static constexpr bool kOnSurface = false;
    EG_INLINE Float facing(Vec3) const { return splat(1.0f); }
    // Light from the edge's own faces would arrive along them. It does not exist, but rounding might sample
    // it.
    EG_INLINE Mask owns(const SceneView& scene, Int emissive) const {
        Mask own = splat(0);
        for (int i = 0; i < W; ++i)
            for (uint32_t k = scene.edge_face_first[edge[i]]; k < scene.edge_face_first[edge[i] + 1]; ++k)
                if (scene.edge_faces[k] == static_cast<uint32_t>(emissive[i])) own[i] = -1;
        return own;
    }
    EG_INLINE Mask faces(Vec3) const { return splat(-1); }
};

// Returns whether a row of the light table (-1: a face) shines on a mesh that a camera path meets after so
// many bounces.
EG_INLINE Mask shines_on(const SceneView& scene, Int row, Int mesh, Int bounces) {
    Mask shines = splat(-1);
    if (scene.lights.any_bounded)
        for (int i = 0; i < W; ++i)
            if (row[i] >= 0 && bounces[i] > scene.lights.max_bounces[row[i]]) shines[i] = 0;
    if (!scene.lights.any_linked) return shines;
    for (int i = 0; i < W; ++i) {
        const int receivers = row[i] >= 0 ? scene.lights.receivers[row[i]] : -1;
        if (receivers >= 0 && !(scene.mesh_receivers[mesh[i]] >> receivers & 1)) shines[i] = 0;
    }
    return shines;
}

// An empty sample of emissive faces and rows of the light table with the numbers `index`.
EG_INLINE LightSample no_light_sample(const SceneView& scene, Mask is_triangle, Mask is_row, Int index,
                                      Int kind) {
    LightSample s;
    s.radiance = zero3();
    s.share = splat(1.0f);
    s.casts_shadow = splat(-1);
    s.blockers = splat(1 << kShadowRay);
    s.visible_to = select(is_row, splat(-1), splat(~kOfTable));
    // A mesh that some kinds of rays cannot hit does not light the lobes that scatter these kinds
    if (scene.lights.any_hidden && any(is_triangle)) {
        const Int seen_by = gather(scene.mesh_mask, mesh_of(scene, select(is_triangle, index, splat(0))));
        s.visible_to = select(is_triangle, seen_by & splat(~kOfTable), s.visible_to);
    }
    s.face = select(is_triangle, index, splat(-1));
    s.row = select(is_row, index, splat(-1));
    s.kind = kind;
    s.b1 = s.b2 = splat(0.0f);
    return s;
}

// Sets the blockers and the visibility of rows.
EG_INLINE void take_links(const LightView& lights, Mask is_row, Int row, Int flags, LightSample& s) {
    if (lights.any_linked) {
        const Int blockers = gather(lights.blockers, row);
        for (int i = 0; i < W; ++i) {
            if (!is_row[i]) continue;
            if (blockers[i] >= 0) s.blockers[i] = 1 << (kFirstBlockers + blockers[i]);
            if (!(flags[i] & kLightCastsShadow)) s.casts_shadow[i] = 0;
        }
    }
    if (lights.any_hidden)
        s.visible_to = select(is_row, gather(lights.visible_to, row) | kOfTable, s.visible_to);
}

// Samples one light and a direction to it, for the point x. Lights that cannot contribute are inactive.
template <typename Point>
EG_INLINE LightSample sample_light_for(const SceneView& scene, Mask active, const Point& x, Float u,
                                       Float v) {
    const LightView& lights = scene.lights;
    // Choose a light
    const LightChoice choice = choose_light(lights, active, x, u);
    const Int kind = gather(lights.kind, choice.light), index = gather(lights.index, choice.light);
    const Mask is_triangle = choice.active & (kind == static_cast<int>(kTriangleLight));
    const Mask is_row = choice.active & ~is_triangle;
    LightSample s = no_light_sample(scene, is_triangle, is_row, index, kind);
    s.active = choice.active;
    s.distant = s.active & (kind >= static_cast<int>(kDirectionLight));
    Vec3 offset{splat(0.0f), splat(0.0f), splat(1.0f)}, lift = zero3();
    Float density = splat(0.0f);
    Mask sized = is_triangle;

    // Sample a point of an emissive face
    if (any(is_triangle)) {
        const Int face = select(is_triangle, index, splat(0));
        Triangle t = gather_triangle(scene, face);
        const Float clearance = ray_offset(t);
        const Vec3 m = area_normal(t);
        t.p0 = t.p0 - x.position, t.p1 = t.p1 - x.position, t.p2 = t.p2 - x.position;
        const ShapeSample shape = sample_triangle_light(t, m, choice.u, v, s.b1, s.b2);
        const Mask front = dot(t.p0, m) < 0.0f;
        offset = select(is_triangle, shape.offset, offset);
        density = select(is_triangle, shape.pdf, density);
        const Int material = gather(scene.face_material, face);
        s.radiance = select(is_triangle, gather3(scene.emission, material), s.radiance);
        s.active &= ~is_triangle | front | (gather(scene.emission_two_sided, material) != 0);
        // A triangle does not light itself, but rounding might sample a hemisphere around the point.
        s.active &= ~is_triangle | ~x.owns(scene, index);
        const Float step = clearance / max(sqrt(dot(m, m)), 1e-30f);
        lift = select(is_triangle, m * select(front, step, -step), lift);
    }
    // Sample a row of the light table by its kind
    if (any(is_row)) {
        const Int row = select(is_row, index, splat(0));
        const LightRow l = gather_light(lights, row);
        const Vec3 center = l.position - x.position;
        const auto take = [&](Mask m, const ShapeSample& shape) {
            offset = select(m, shape.offset, offset);
            density = select(m, shape.pdf, density);
            sized |= m;
        };
        const auto is = [&](int k) { return is_row & (kind == k); };
        const auto occurs = [&](int k) { return (lights.kinds >> k & 1) && any(is(k)); };
        if (occurs(kPointSource)) offset = select(is(kPointSource), center, offset);
        if (occurs(kDirectionLight)) offset = select(is(kDirectionLight), -l.direction, offset);
        if (occurs(kSphereLight)) take(is(kSphereLight), sample_sphere(center, l.radius, choice.u, v));
        if (occurs(kDiskLight))
            take(is(kDiskLight), Point::kOnSurface ? sample_facing_disk(center, l.radius, choice.u, v)
                                                   : sample_sphere(center, l.radius, choice.u, v));
        // Area lights emit to one side.
        const Mask flat = is(kRectangleLight) | is(kEllipseLight);
        if (any(flat)) {
            const AreaShape area = area_shape(l, x.position);
            const Mask spread = (l.flags & static_cast<int>(kLightSpread)) != 0;
            const Mask by_rectangle = is(kRectangleLight) | (flat & spread), by_area = flat & ~by_rectangle;
            s.active &= ~flat | ((dot(center, l.direction) < 0.0f) & (area.area > 0.0f));
            if (any(by_rectangle)) take(by_rectangle, sample_rectangle(area, choice.u, v));
            if (any(by_area)) take(by_area, sample_ellipse(area, choice.u, v));
            const Mask cut = is(kEllipseLight) & spread;
            if (any(cut)) s.active &= ~cut | within_ellipse(l, offset - center);
        }
        if (occurs(kConeLight))
            take(is(kConeLight), {sample_cone(-l.direction, l.one_minus_cos, choice.u, v), 1.0f / l.area});
        // Compute the row's radiance
        s.radiance = select(is_row, l.radiance, s.radiance);
        take_links(lights, is_row, row, l.flags, s);
        const Float r = sqrt(max(dot(offset, offset), 1e-37f));
        // The distance from an edge says nothing of the decay of light that passes it.
        const Vec3 w = offset * (1.0f / r);
        s.share = select(is_row, Point::kOnSurface ? light_factor(l, w, r) : light_factor(l, w), s.share);
        s.radiance = s.radiance * s.share;
    }

    // Compute the direction, the density and the geometric factor
    const Float r2 = max(dot(offset, offset), 1e-37f);
    s.r = select(s.distant, splat(__builtin_inff()), sqrt(r2));
    s.w = select(s.distant, offset, offset * (1.0f / sqrt(r2)));
    s.end = x.position + offset + lift;
    s.pdf = select(sized, density * choice.probability, 0.0f);
    const Float flux = select(s.distant, choice.probability, choice.probability * r2);
    s.geometry = 1.0f / max(select(sized, s.pdf, flux), 1e-37f);
    // Directions in the plane of an area light may have no end point.
    s.active &= x.faces(s.w) & (r2 < 1e30f);
    if (!lights.dark_too) s.active &= largest_component(s.radiance) > 0.0f;
    return s;
}

}  // namespace edgegrad::EDGEGRAD_ISA
