// A point of an edge as the camera sees it: its place in the picture, the area that it sweeps there, and the
// surfaces on its two sides.
#pragma once

#include "boundary/samples/segment_sampling.h"
#include "film/splat.h"
#include "path/lens_sample.h"
#include "scene/rays/rays.h"
#include "shading/surface_shader.h"
#include "tasks/boundary_task.h"

namespace edgegrad::EDGEGRAD_ISA {

struct EdgeSample {
    Mask active;
    Int edge, instance;
    Mask intersection;  // an intersection line of two faces instead of an edge
    Float u;            // position along the edge
    Float weight;       // kappa / density
    Vec3 point, tangent;
    Vec3 end;     // the edge's first end
    Vec3 normal;  // N = D x t
    Projection view;
    PathIndex random;
    Int mask;  // mask of the rays towards the point
};

// Samples [task.first + at, ...) of the segments, each seen through its own point of the lens, or that of its
// line. bend(s) may move s.point from the segment to a curve near it, whose derivative by u is then
// s.tangent.
template <typename Bend>
EG_INLINE EdgeSample sample_curve(const SceneView& scene, const BoundaryTask& task, int64_t at,
                                  SegmentCursor& cursor, const Bend& bend) {
    const SegmentSample place = sample_edge_segment(scene, task, at, cursor);
    const CameraView& c = scene.camera;
    EdgeSample s;
    s.active = place.active;
    s.edge = place.edge;
    s.instance = place.instance;
    s.intersection = is_intersection(scene, place.edge);
    s.random = place.random;
    s.mask = splat(1 << kCameraRay);
    const Float length = place.u1 - place.u0;
    Float du;  // du / dtau
    if (c.kind == kPerspective) {
        // Sample uniformly along the projected segment. With depths z0 and z1 at its ends, the fraction tau
        // of the projected length lies at the fraction tau z0/(z1 + tau (z0 - z1)) of the segment in space.
        const Vec3 back = splat3(c.back);
        const Float z_a = -dot(back, place.a - splat3(c.position)), z_t = -dot(back, place.t);
        const Float z0 = max(z_a + place.u0 * z_t, 1e-30f), z1 = max(z_a + place.u1 * z_t, 1e-30f);
        const Float w = z1 + place.tau * (z0 - z1);
        s.u = place.u0 + length * (place.tau * z0 / w);
        du = length * (z0 * z1 / (w * w));
    } else {
        s.u = place.u0 + length * place.tau;
        du = length;
    }
    // Record the position and project the point
    if (task.record.contribution)
        for (int i = 0; i < W && at + i < task.count; ++i)
            if (const int64_t k = task.first + at + i; task.record.has(k))
                task.record.u[task.record.place(k)] = s.u[i];
    s.tangent = place.t;
    s.end = place.a;
    s.point = place.a + place.t * s.u;
    bend(s);
    LensPoint lens = lens_of(c, place.random);
    float share = 1.0f;
    if (scene.line_lens) {
        share = 1.0f / static_cast<float>(scene.lens_points);
        for (int i = 0; i < W; ++i) {
            if (!s.active[i]) continue;
            const float* at = scene.line_lens + 2 * scene.intersection(s.edge[i]);
            lens.x[i] = at[0], lens.y[i] = at[1];
        }
    }
    s.view = project(c, s.point, lens);
    s.active &= s.view.active & in_reach(c, s.view.sx, s.view.sy) & (s.view.distance > s.view.near) &
                (s.view.distance < s.view.far);
    s.normal = cross(s.view.across_of, s.tangent);
    s.weight = du * s.view.area * (task.scale * share) / place.density;
    return s;
}
[[maybe_unused]] EG_OUTLINE EdgeSample sample_edge(const SceneView& scene, const BoundaryTask& task,
                                                   int64_t at, SegmentCursor& cursor) {
    return sample_curve(scene, task, at, cursor, [](EdgeSample&) EG_INLINE_LAMBDA {});
}

// The visible face on one side of an edge: the nearest of the faces on that side, as the camera sees them.
struct SideFace {
    Int face;      // -1: none is there
    Int instance;  // placing the face
    Int opposite;  // its corner off the edge, 0 to 2
    Float slope;   // depth slope across the edge
};

struct Sides {
    SideFace plus, minus;  // the side to which N points, and the other
    // Rays that leave a face at the edge may start behind another face of the edge. This is not possible at
    // borders, nor if the two faces meet at an obtuse angle (narrow_pair).
    Mask narrow;
};

// One face of each lane's edge.
struct EdgeFace {
    Int face, instance, opposite;  // its corner off the edge, 0 to 2
    Vec3 normal;                   // area normal
    Vec3 way;                      // from the edge's first end to that corner; 0 for intersections
};

// The k-th face of each lane's edge, at `place` in the scene's list of edge faces, for the lanes `there` that
// have one.
EG_INLINE EdgeFace face_beside(const SceneView& scene, const EdgeSample& s, Mask there, Int place, int k) {
    const Mask intersection = there & s.intersection;
    const auto entries = [&](const uint32_t* table, Mask m) {
        return gather(table, select(m, place, splat(0)));
    };
    EdgeFace f;
    f.face = entries(scene.edge_faces, there);
    f.instance = face_instance(scene, s.edge, intersection, select(there, s.instance, splat(-1)), k);
    const Int corner = entries(scene.edge_opposite, there & ~intersection);
    Rows corners[3];
    gather_corners(scene.faces, f.face, corners);
    Triangle t = {gather3(scene.vertices, corners[0]), gather3(scene.vertices, corners[1]),
                  gather3(scene.vertices, corners[2])};
    place_triangle(scene, f.instance, t);
    f.normal = area_normal(t);
    const Mask zero = packet(corners[0]) == corner, one = packet(corners[1]) == corner;
    f.opposite = select(intersection | zero, splat(0), select(one, splat(1), splat(2)));
    f.way = select(intersection, zero3(), select(zero, t.p0, select(one, t.p1, t.p2)) - s.end);
    return f;
}

// Whether two faces of an edge of direction t meet at an angle that is not clearly obtuse.
EG_INLINE Mask narrow_pair(const EdgeFace (&pair)[2], Vec3 t) {
    Vec3 across[2];
    for (int k = 0; k < 2; ++k) {
        const Vec3 g = cross(pair[k].normal, t);
        across[k] = select(dot(g, pair[k].way) < 0.0f, -g, g);
    }
    constexpr float kBlunt = -0.25f;
    // The product of the squares, twelve lengths, would overflow in large worlds
    const Float lengths = sqrt(dot(across[0], across[0])) * sqrt(dot(across[1], across[1]));
    return dot(across[0], across[1]) >= kBlunt * lengths;
}

// Finds on each side the face nearest to the camera just beside the edge: the face of smallest depth slope
// -(n . g)/(n . D), g = +-N (derivations, A3). A face seen exactly edge-on lies on no side. Faces that
// intersect lie on both sides.
EG_INLINE Sides visible_faces(const SceneView& scene, const EdgeSample& s) {
    const SideFace none = {splat(-1), splat(-1), splat(0), splat(__builtin_inff())};
    Sides sides{none, none, splat(-1)};
    if (!any(s.active)) return sides;  // there may be no edges
    const Int edge = select(s.active, s.edge, splat(0)), first = gather(scene.edge_face_first, edge);
    const Int count = s.active & (gather(scene.edge_face_first + 1, edge) - first);
    EdgeFace pair[2];
    for (int k = 0; any(count > k); ++k) {
        const Mask there = count > k;
        const EdgeFace f = face_beside(scene, s, there, first + k, k);
        if (k < 2) pair[k] = f;
        const Float md = dot(f.normal, s.view.across_of), mn = dot(f.normal, s.normal);
        const Float side = dot(s.normal, f.way);
        const Mask beside = there & (md != 0.0f) & ((side != 0.0f) | s.intersection);
        const Float slope = -mn / select(md != 0.0f, md, 1.0f);
        const auto offer = [&](SideFace& best, Mask here, Float lower) EG_INLINE_LAMBDA {
            const Mask better = beside & here & (lower < best.slope);
            best.face = select(better, f.face, best.face);
            best.instance = select(better, f.instance, best.instance);
            best.opposite = select(better, f.opposite, best.opposite);
            best.slope = select(better, lower, best.slope);
        };
        offer(sides.plus, side >= 0.0f, slope);
        offer(sides.minus, side <= 0.0f, -slope);
    }
    sides.narrow = count != 1;
    const Mask two = (count == 2) & ~s.intersection;
    if (any(two)) sides.narrow &= ~two | narrow_pair(pair, s.tangent);
    return sides;
}

// The transmittance and the number of the transparent surfaces that rays have passed.
struct PassedSurfaces {
    Vec3 through = one3();
    Int passed = splat(0);
};

// What the camera sees behind the edge, and whether the edge lies in that face (contact). Surfaces that rays
// have passed are in front of the edge.
struct Behind : PassedSurfaces {
    Closest hit;
    Mask touched;
};

// Decides for each hit surface whether the ray of `kind` passes it, with probability by its transparency and
// by the random numbers of paths. `near` is set to behind the surfaces that are passed.
EG_OUTLINE Mask passes(const SceneView& scene, Mask blocked, const Closest& hit, Vec3 direction, RayKind kind,
                       const PathIndex& random, PassedSurfaces& before, Float& near) {
    const SurfacePoint x = hit_surface(scene, blocked, hit, direction);
    const TexturePoint point = texture_point(scene, x, -direction, splat(kind));
    const Float choice = sobol_pair(random, vertex_pair(before.passed, kVertexChoice)).u;
    const Float chance = sobol_pair(random, vertex_pair(before.passed, kVertexSurvival)).v;
    const Shader shader = surface_shader(scene, x, point, choice);
    Vec3 color;
    const Mask pass = x.active & has(shader, kHasTransparency) & (chance < passing_share(shader, color));
    before.through = select(pass, before.through * color * shader.scale, before.through);
    before.passed = before.passed - pass;
    near = select(pass, hit.distance + 2.0f * x.offset, near);
    return pass;
}

// The surfaces that rays through a point of an edge ignore: the edge's faces.
struct EdgeFaces {
    static constexpr bool kField = false;
    EG_INLINE Ignored ignored(const EdgeSample& s) const { return {s.edge, s.instance}; }
};
// The same at the outline of a distance field: its surface, which the ray grazes, nearer than `contact`.
struct GrazedField {
    static constexpr bool kField = true;
    Int face;
    Float contact;
    EG_INLINE Ignored ignored(const EdgeSample&) const { return ignore_nothing(); }
    // The length around the point within which hits of a face do not count; 0: they do.
    EG_INLINE Float contact_of(Int of_face) const { return select(of_face == face, contact, 0.0f); }
};
// The same where fields pass through other surfaces: one or two of the curve's surfaces are fields, and a
// face of a mesh is ignored as for edges.
struct CrossedFields {
    static constexpr bool kField = true;
    Int face[2];
    Float contact[2];  // 0: no field
    EG_INLINE Ignored ignored(const EdgeSample& s) const { return {s.edge, s.instance}; }
    EG_INLINE Float contact_of(Int of_face) const {
        return select(of_face == face[0], contact[0], select(of_face == face[1], contact[1], 0.0f));
    }
};

// Traces rays from the camera through e that ignore the edge's faces. Lanes where e is occluded become
// inactive. The rays start at the camera, so that a surface that touches the edge is not missed. If the edge
// has a visible face on both sides, nothing farther away matters, and the rays end there.
template <typename Own>
EG_OUTLINE Behind look_behind(const SceneView& scene, EdgeSample& s, const Sides& sides, int most_transparent,
                              const Own& own) {
    constexpr float kContact = 1e-5f, kAlong = 1e-3f, kHere = 1e-3f, kBefore = 1e-5f;
    const Float scale = max(largest_component(s.point), s.view.distance);
    Behind behind;
    behind.hit = no_hit();
    behind.touched = splat(0);
    Float near = s.view.near;
    const Mask hidden = (sides.plus.face >= 0) & (sides.minus.face >= 0);
    const Float far = select(hidden, min(s.view.far, s.view.distance + scale * kHere), s.view.far);
    Mask looking = s.active;
    while (any(looking)) {
        // Find the next surface along the ray
        const Closest hit = intersect(scene, looking, s.view.origin, s.view.direction, near, far,
                                      own.ignored(s), embree::kCoherent, s.mask);
        Mask grazed = splat(0);
        if constexpr (Own::kField) {
            const Float contact = own.contact_of(hit.face);
            grazed = looking & hit.hit & (abs(hit.distance - s.view.distance) < contact);
            near = select(grazed, s.view.distance + contact, near);
        }
        // Contact: the hit is close to e and the edge lies in the plane of the face.
        Mask touched = splat(0);
        if constexpr (!Own::kField) touched = hit.hit & (abs(hit.distance - s.view.distance) < scale * kHere);
        if (any(touched)) {
            const Triangle t = placed_triangle(scene, hit.face, hit.instance).triangle;
            const Vec3 m = area_normal(t);
            const Float length = max(sqrt(dot(m, m)), 1e-30f);
            touched &= (abs(dot(m, s.point - t.p0)) < length * scale * kContact) &
                       (abs(dot(m, s.tangent)) < length * sqrt(dot(s.tangent, s.tangent)) * kAlong);
        }
        // Keep the hits at or behind the edge
        const Mask blocked =
            looking & hit.hit & ~touched & ~grazed & (hit.distance < s.view.distance - scale * kBefore);
        const Mask seen = looking & ~blocked & ~grazed;
        behind.hit = select(seen, hit, behind.hit);
        behind.touched |= seen & touched;
        // Continue behind transparent surfaces in front of the edge
        looking = blocked & (behind.passed < most_transparent);
        if (!(scene.all_flags & kHasTransparency)) looking = splat(0);
        if (any(looking))
            looking = passes(scene, looking, hit, s.view.direction, kCameraRay, s.random, behind, near);
        looking |= grazed;
        s.active &= seen | looking | ~(seen | blocked);
    }
    return behind;
}

// The depth slope of the plane in which the edge lies, on the side of N. On the other side it is the
// negative.
EG_INLINE Float touched_slope(const SceneView& scene, const EdgeSample& s, const Closest& hit) {
    const Vec3 m = area_normal(placed_triangle(scene, hit.face, hit.instance).triangle);
    const Float md = dot(m, s.view.across_of);
    return select(md != 0.0f, -dot(m, s.normal) / select(md != 0.0f, md, 1.0f), splat(__builtin_inff()));
}

// The distance from the edge at which rays beside it start on a face. It is large enough that a ray that
// leaves the surface (at SurfacePoint::offset) starts on the right side of another face of the edge or of a
// touching surface, unless their angle is below 1/32. It is small enough that occlusion is that at the edge
// itself.
EG_INLINE Float aside(const Triangle& t) { return 32.0f * ray_offset(t); }

// The barycentrics of e on a triangle that contains the edge, and the step from e to the side of `outwards`.
EG_INLINE Vec3 beside_in_plane(const EdgeSample& s, const Triangle& t, Vec3 outwards, Float& b1, Float& b2) {
    place_in_face(t, s.point, b1, b2);
    const Vec3 across = unit_vector(cross(area_normal(t), s.tangent));
    return select(dot(across, outwards) < 0.0f, -across, across) * aside(t);
}

// The barycentrics of the point e of the edge on the face `near`, and the step from e to the side of
// `outwards` (+-N).
EG_INLINE Vec3 near_point(const SceneView& scene, const EdgeSample& s, const SideFace& near, Vec3 outwards,
                          Float& b1, Float& b2) {
    const Mask active = s.active & (near.face >= 0);
    const Int face = select(active, near.face, splat(0));
    Triangle t = gather_triangle(scene, face);
    edge_place(scene, select(active & ~s.intersection, s.edge, splat(0)), s.u, t, near.opposite, b1, b2);
    place_triangle(scene, select(active, near.instance, splat(-1)), t);
    // Step towards the opposite corner, at most an eighth of the way.
    const Vec3 corner = select(near.opposite == 0, t.p0, select(near.opposite == 1, t.p1, t.p2));
    const Vec3 sheet = cross(s.tangent, corner - s.point);
    const Float height = sqrt(dot(sheet, sheet) / max(dot(s.tangent, s.tangent), 1e-37f));
    const Vec3 step = (corner - s.point) * min(aside(t) / max(height, 1e-30f), splat(0.125f));
    if (!any(active & s.intersection)) return step;
    // Step across the line in the face's plane. Rays may start slightly outside of the triangle.
    Float c1, c2;
    const Vec3 across = beside_in_plane(s, t, outwards, c1, c2);
    b1 = select(s.intersection, c1, b1);
    b2 = select(s.intersection, c2, b2);
    return select(s.intersection, across, step);
}

// The same for the surface that contains the edge.
EG_INLINE Vec3 touched_point(const SceneView& scene, const EdgeSample& s, const Closest& hit, Vec3 outwards,
                             Float& b1, Float& b2) {
    return beside_in_plane(s, placed_triangle(scene, hit.face, hit.instance).triangle, outwards, b1, b2);
}

}  // namespace edgegrad::EDGEGRAD_ISA
