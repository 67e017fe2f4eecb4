// Primary boundary term of straight borders within faces at which textures jump, such as the sides of squares
// of checkerboards (boundary/curves/texture_borders.h).
//
// It is that of edges (boundary/terms/primary.h). The border is a line of material points of its face: its
// point e moves with the face, and the face is on both sides.
#pragma once

#include "boundary/samples/intersection_point.h"
#include "boundary/terms/primary.h"

namespace edgegrad::EDGEGRAD_ISA {

// A sample with its face, in the place of TracedSample. b1 and b2 are the barycentrics of the point.
struct TracedBorder {
    EdgeSample sample;
    Vec3 factor;
    Int face, instance;
    Float b1, b2;
};

// Finds the face of each lane's border, and the place of its point in the face.
EG_INLINE Triangle place_border(const SceneView& scene, TracedBorder& border) {
    const EdgeSample& s = border.sample;
    const IntersectionFace own = intersection_face(scene, s, s.active, 0);
    border.face = own.face;
    border.instance = own.instance;
    const Triangle t = placed_triangle(scene, border.face, border.instance).triangle;
    place_in_face(t, s.point, border.b1, border.b2);
    return t;
}

// The hit on the side of `outwards`, where textures have the values of that side: a little beside the border.
EG_INLINE Closest border_hit(const SceneView& scene, const TracedBorder& border, const Triangle& t,
                             Vec3 outwards) {
    const EdgeSample& s = border.sample;
    Float b1, b2;
    const Vec3 step = beside_in_plane(s, t, outwards, b1, b2);
    Closest hit;
    hit.hit = s.active;
    hit.face = border.face;
    hit.instance = border.instance;
    hit.mesh = mesh_of(scene, border.face);
    place_in_face(t, s.point + step, hit.b1, hit.b2);
    hit.distance = s.view.distance;
    return hit;
}

struct BorderCurves {
    using Traced = TracedBorder;

    EG_INLINE static void start(const SceneView& scene, const BoundaryTask& task, Workspace& work,
                                const FactorOf<TracedBorder>& factor, TracedBorder& kept, int at,
                                SegmentCursor& cursor, int& queued) {
        const int count = static_cast<int>(task.count);
        EdgeSample& s = kept.sample;
        // Sample a point of a border
        s = sample_edge(scene, task, at, cursor);
        if (!any(s.active)) return;
        const Triangle t = place_border(scene, kept);
        set_factor(task, kept, factor);
        // Find out what is in front of it
        const SideFace own{kept.face, kept.instance, splat(0), splat(0.0f)};
        Behind before;
        if (any(s.active))
            before = look_behind(scene, s, Sides{own, own, splat(0)}, task.limits.transparent, EdgeFaces{});
        if (!any(s.active)) return;
        // Start a path on each side
        for (int k = 0; k < 2; ++k) {
            const Closest hit = border_hit(scene, kept, t, k == 0 ? s.normal : -s.normal);
            queued = start_side(task, work, queued, s, lane_index() + at + (k == 0 ? 0 : count),
                                s.view.direction, hit, zero3(), before);
        }
    }
    template <typename Mode>
    EG_INLINE static void blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                                 const TracedBorder& border, Vec3 color) {
        const EdgeSample& s = border.sample;
        view_blocks(mode, scene, motion, s, color);
        face_point_blocks(mode, scene, motion, s.active, border.face, border.instance, border.b1, border.b2,
                          s.normal * s.weight, color);
    }
};

}  // namespace edgegrad::EDGEGRAD_ISA
