// Contact: light between surfaces that nearly touch, as where a box stands on a floor or a sheet passes
// through a lamp.
//
// In material form y moves with its surface, and light from y to x changes with the rate 1/r of their
// relative motion, r = |y - x|. Beside a line of contact the variance of this estimate is infinite
// (derivations, C5). With a fixed direction from x to y instead, y moves along its surface with the ray, and
// no factor 1/r remains. But then the borders of y's surface move over y. Therefore y moves with the blend
//   v = m(y) + b (v_1 - m(y)),   v_1 = dx + w n_y . (m(y) - dx)/(n_y . w),
// where b is 1 near x and decreases to 0 at the borders of y's triangle. The light that x receives changes by
//   d log(measure) = (1 - b) R + grad b . (v_1 - m(y)),
// where R is the rate of |w . M|/r^2 in material form. f and the texture at y move with v. Edges of shadows
// sweep over segments that move with (1 - b) times y's motion and the rest of x's
// (boundary/segment/segment.h).
//
// Triangles that form a convex polygon with their coplanar neighbours have the polygon's borders
// (boundary/meshes/coplanar_polygons.h), because v is continuous over a polygon.
//
// Borders behind x's own plane do not count, unless x scatters light from behind: x does not see them, as
// the floor does not see the lower side of a wall that is sunk in it. Neither do borders in that plane: light
// from there arrives along x's horizon, where |n_x . w| vanishes. Where n_x is not the face's own normal, it
// does not vanish, and the horizon moves over y with the weight of the material form
// (boundary/terms/horizon.h). There such borders still do not count if x and y are on the same mesh, so that
// the horizon term alone has the flux across them. They count if y may emit light: samples of lights in x's
// plane do not find a light that only touches it.
//
// Where y moves over its surface, normal maps move under it, and their contrast is noise. So rho is at most a
// small part of the smaller mesh (kMappedReach) where y has such a map.
//
// Borders at which textures jump count, because y moves over them: of texels of an image without
// interpolation, and of squares of a checkerboard (scene/textures/jumps.h). Textures that jump elsewhere keep
// their mesh from the blend (scene/contact_meshes.h).
//
// Where no face of y's mesh emits light and the lobes of x are wide, borders do not count at all: samples
// along edges have what moves over them (boundary/terms/contact_border.h). Then rho is a part of the smaller
// mesh, for faces of any size.
//
// Between x and y there must be no transparent surface, because its share of the light does not move with the
// blend. Boxes around transparent faces therefore count as borders: a segment to y that is shorter than the
// distance from y to a box does not meet it. With rho the distance to the nearest border that counts,
//   b = 1 - s^2 (3 - 2 s),   s = min(r/(kReach rho), 1),
// so that no border that counts needs samples of its own. kReach trades the error near contact for noise from
// light of a fixed direction where surfaces do not touch.
#pragma once

#include "scene/cell_borders.h"

namespace edgegrad::EDGEGRAD_ISA {

// b, and the drift: grad b . (v_1 - m) = drift . (dx - m(y)).
struct Contact {
    Float share;
    Vec3 drift;
};

EG_INLINE Contact no_contact() { return {splat(0.0f), zero3()}; }

// Lanes between whose meshes the direction of light is fixed near contact.
EG_INLINE Mask may_blend(const SceneView& scene, Mask active, Int from, Int to) {
    const Int receives = gather(scene.mesh_contact, select(active, from, splat(0)));
    const Int sends = gather(scene.mesh_contact, select(active, to, splat(0)));
    return active & ((receives & kContactFrom) != 0) & ((sends & kContactTo) != 0);
}

// Lanes in which samples along edges have what moves over borders (boundary/terms/contact_border.h).
EG_INLINE Mask borders_are_sampled(const SceneView& scene, Int receives, Int sends) {
    if (!scene.sampled_borders) return splat(0);
    return ((receives & kContactWide) != 0) & ((sends & kContactOpen) != 0);
}

// The nearest border that counts: its distance rho from y, and the gradient of rho.
struct NearestBorder {
    Float distance;
    Vec3 inward;

    EG_INLINE void add(Mask counts, Float other, Vec3 gradient) {
        const Mask nearer = counts & (other < distance);
        distance = select(nearer, other, distance);
        inward = select(nearer, gradient, inward);
    }
};

// Adds the boxes around transparent faces.
EG_INLINE void add_transparent_boxes(const SceneView& scene, Mask active, Vec3 y, NearestBorder& border) {
    for (int k = 0; k < scene.transparent_box_count; ++k) {
        const float* box = scene.transparent_boxes + 6 * k;
        const Vec3 nearest = {min(max(y.x, splat(box[0])), splat(box[3])),
                              min(max(y.y, splat(box[1])), splat(box[4])),
                              min(max(y.z, splat(box[2])), splat(box[5]))};
        const Vec3 away = y - nearest;
        const Float distance = sqrt(dot(away, away));
        border.add(active, distance, away * (1.0f / max(distance, 1e-30f)));
    }
}

// A vertex of a mesh, as placed by an instance.
EG_INLINE Vec3 placed_vertex(const SceneView& scene, Int vertex, Int instance) {
    const Vec3 p = gather3(scene.vertices, vertex);
    const Mask placed = instance >= 0;
    return any(placed) ? select(placed, place_point(gather_placement(scene, instance), p), p) : p;
}

// The blend for light from the point y of a triangle `t` of mesh `to`, which is `face` as placed by
// `instance`, to x, on a face of mesh `from` with the normal `normal`.
EG_OUTLINE Contact contact(const SceneView& scene, Mask active, Int from, Vec3 x, Vec3 normal, Int to,
                           Int face, Int instance, const Triangle& t, Vec3 y) {
    constexpr float kReach = 1.0f, kSlack = 1e-5f, kRounding = 1e-6f, kMappedReach = 1.0f / 64,
                    kSampledReach = 0.5f;
    active = may_blend(scene, active, from, to);
    if (!any(active)) return no_contact();
    const Int receives = gather(scene.mesh_contact, select(active, from, splat(0)));
    const Int sends = gather(scene.mesh_contact, select(active, to, splat(0)));
    // Lanes in which borders in x's plane count, and those behind it
    const Mask through = (receives & kContactThrough) != 0;
    const Mask all_count = ((receives & kContactBent) != 0) & ((from != to) | ((sends & kContactEmits) != 0));
    const Int polygon =
        scene.face_polygon ? gather(scene.face_polygon, select(active, face, splat(0))) : splat(-1);
    const Mask sampled = active & borders_are_sampled(scene, receives, sends);
    // Over the triangles of a polygon, coordinates of cells may change in different ways.
    const Mask gridded = active & ((sends & kContactCells) != 0);
    const Mask grouped = active & (polygon >= 0) & ~gridded & ~sampled;
    const Vec3 way = y - x;
    const Vec3 side[3] = {t.p1 - t.p0, t.p2 - t.p1, t.p0 - t.p2};
    const Float square = dot(way, way);
    // In a triangle, rho is at most the length of a side.
    active &= grouped | sampled |
              (square < kReach * kReach *
                            max(max(dot(side[0], side[0]), dot(side[1], side[1])), dot(side[2], side[2])));
    if (!any(active)) return no_contact();
    const Vec3 m = area_normal(t);
    const Float twice_area = sqrt(dot(m, m)), r = sqrt(square);
    const Vec3 n = m * (1.0f / max(twice_area, 1e-37f)), w = way * (1.0f / max(r, 1e-30f));
    const Float in_plane = kSlack * sqrt(twice_area) + kRounding * largest_component(x);
    const Vec3 corner[3] = {t.p0, t.p1, t.p2};
    NearestBorder border{splat(__builtin_inff()), zero3()};
    const auto add_side = [&](Mask counts, Vec3 a, Vec3 e) {
        const Vec3 across = cross(n, e);
        const Vec3 in = across * (1.0f / max(sqrt(dot(across, across)), 1e-37f));
        const Float first = dot(normal, a - x), last = dot(normal, a + e - x);
        const Float above = max(first, last), behind = -min(first, last);
        const Mask in_front = above > select(all_count, -in_plane, in_plane);
        border.add(counts & (in_front | (through & (behind > in_plane))), dot(in, y - a), in);
    };
    const Mask alone = active & ~grouped & ~sampled;
    for (int k = 0; k < 3 && any(alone); ++k) add_side(alone, corner[k], side[k]);
    Mask more = active & grouped;
    for (int k = 0; k < kPolygonSides && any(more); ++k) {
        const Int at = select(more, polygon * (2 * kPolygonSides) + 2 * k, splat(0));
        const Int first = gather(scene.polygon_sides, at), last = gather(scene.polygon_sides + 1, at);
        more &= first >= 0;
        const Int placed = select(more, instance, splat(-1));
        const Vec3 a = placed_vertex(scene, select(more, first, splat(0)), placed);
        add_side(more, a, placed_vertex(scene, select(more, last, splat(0)), placed) - a);
    }
    add_transparent_boxes(scene, active, y, border);
    if (any(gridded))
        for_each_cell_border(scene, gridded, face, t, n, twice_area, y,
                             [&](Mask counts, Float distance, Vec3 in) { border.add(counts, distance, in); });
    if (any(sampled)) {
        const Float size = min(gather(scene.mesh_size, select(sampled, from, splat(0))),
                               gather(scene.mesh_size, select(sampled, to, splat(0))));
        border.add(sampled, size * kSampledReach, zero3());
    }
    const Mask mapped = active & ((sends & kContactMapped) != 0);
    if (any(mapped)) {
        const Float size = min(gather(scene.mesh_size, select(mapped, from, splat(0))),
                               gather(scene.mesh_size, select(mapped, to, splat(0))));
        border.add(mapped, size * kMappedReach, zero3());
    }
    const Float rho = border.distance;
    const Vec3 inward = border.inward;
    const Float facing = dot(n, w), q = r / max(rho, 1e-30f), s = q * (1.0f / kReach);
    const Mask near = active & (r > 0.0f) & (facing != 0.0f) & (s < 1.0f) & (rho < __builtin_inff());
    if (!any(near)) return no_contact();
    const Float slope = -6.0f / kReach * s * (1.0f - s);
    const Vec3 gradient = (w - inward * q) * (slope / max(rho, 1e-30f));
    const Vec3 drift = gradient - n * (dot(gradient, w) / select(near, facing, 1.0f));
    return {select(near, 1.0f - s * s * (3.0f - 2.0f * s), splat(0.0f)), select(near, drift, zero3())};
}

// The blend for light from a face at (b1, b2).
EG_INLINE Contact contact_with_face(const SceneView& scene, Mask active, const SurfacePoint& x, Int face,
                                    Int instance, Float b1, Float b2) {
    if (!scene.mesh_contact || !any(active)) return no_contact();
    const Int known = select(active, face, splat(0)), to = mesh_of(scene, known);
    active = may_blend(scene, active, x.mesh, to);
    if (!any(active)) return no_contact();
    const Triangle t = placed_triangle(scene, known, select(active, instance, splat(-1))).triangle;
    return contact(scene, active, x.mesh, x.position, x.normal, to, known,
                   select(active, instance, splat(-1)), t, interpolate(t, b1, b2));
}

}  // namespace edgegrad::EDGEGRAD_ISA
