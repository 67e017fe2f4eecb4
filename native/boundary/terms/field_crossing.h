// Primary boundary term of the curves along which distance fields pass through meshes and through each other.
//
// It is that of intersection lines of faces (boundary/terms/primary.h; derivations, F1), but that the surface
// of a field moves along its normal: with N = mu_1 n_1 + mu_2 n_2, the normals n_k at the point and a change
// dphi of the field k of gradient g,
//   N . de = sum of mu_k n_k . m_k,    n_k . m_k = -dphi / |g|.
// Both surfaces are on both sides of the curve, and the camera sees the nearer one of each.
#pragma once

#include "boundary/samples/crossing_samples.h"
#include "boundary/terms/primary.h"

namespace edgegrad::EDGEGRAD_ISA {

// A sample with its curve, in the place of TracedSample.
struct TracedCrossing {
    EdgeSample sample;
    Vec3 factor;
    CrossingSample curve;
};

EG_OUTLINE void bend_to_crossing(const SceneView& scene, EdgeSample& s, CrossingSample& curve) {
    place_on_crossings(scene, s.active, s.edge, s.u, curve);
    s.point = select(s.active, curve.position, s.point);
    s.tangent = select(s.active, curve.tangent, s.tangent);
}

// The number of the surface that the camera sees on the side of N; it sees the other one on the other side.
// Samples without a nearer surface become inactive.
EG_INLINE Int nearer_beside(EdgeSample& s, const CrossingSample& curve) {
    Float slope[2];
    for (int k = 0; k < 2; ++k) {
        const Float along = dot(curve.side[k].normal, s.view.across_of);
        s.active &= along != 0.0f;
        slope[k] = -dot(curve.side[k].normal, s.normal) / select(along != 0.0f, along, 1.0f);
    }
    s.active &= slope[0] != slope[1];
    return select(slope[0] < slope[1], splat(0), splat(1));
}

// The hit on a side, where `second` tells which surface is seen.
EG_INLINE Closest crossing_hit(const SceneView& scene, const EdgeSample& s, const CrossingSample& curve,
                               Mask second) {
    const auto &one = curve.side[0], &other = curve.side[1];
    Closest hit;
    hit.hit = s.active;
    hit.face = select(s.active, select(second, other.face, one.face), splat(0));
    hit.instance = select(second, other.instance, one.instance);
    hit.mesh = mesh_of(scene, hit.face);
    hit.b1 = select(second, other.b1, one.b1);
    hit.b2 = select(second, other.b2, one.b2);
    hit.distance = s.view.distance;
    return hit;
}

// The surfaces of a curve, neither of which hides what is behind the other.
EG_INLINE Sides crossed_sides(const CrossingSample& curve) {
    const auto face = [&](int k) EG_INLINE_LAMBDA {
        return SideFace{curve.side[k].face, curve.side[k].instance, splat(0), splat(0.0f)};
    };
    return {face(0), face(1), splat(0)};
}

// Calls start(k, hit, step) for both sides of a curve, of which 0 is that of N: the hit there, and the step
// to where its path starts, a little beside the curve. `plus`: what nearer_beside() returned.
template <typename Start>
EG_INLINE void start_on_both_sides(const SceneView& scene, const EdgeSample& s, const CrossingSample& curve,
                                   Int plus, const Start& start) {
    const Float length = step_length(scene, s.active, curve);
    for (int k = 0; k < 2; ++k) {
        const Mask second = plus == (k == 0 ? 1 : 0);
        const Vec3 outwards = k == 0 ? s.normal : -s.normal;
        start(k, crossing_hit(scene, s, curve, second),
              select(second, step_beside(curve.side[1], s.tangent, outwards, length),
                     step_beside(curve.side[0], s.tangent, outwards, length)));
    }
}

// Adds the motion of points of a curve, with the weight of `s`, times `color`.
template <typename Mode>
EG_INLINE void crossing_blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion, Mask active,
                               const EdgeSample& s, const CrossingSample& curve, Vec3 color) {
    Float mu[2];
    part_normals(s.normal * s.weight, curve.side[0].normal, curve.side[1].normal, mu[0], mu[1]);
    for (int k = 0; k < 2; ++k)
        plane_point_blocks(mode, scene, motion, active, curve.side[k].face, curve.side[k].instance, s.point,
                           curve.side[k].normal * mu[k], color);
}

struct CrossingCurves {
    using Traced = TracedCrossing;

    EG_INLINE static void start(const SceneView& scene, const BoundaryTask& task, Workspace& work,
                                const FactorOf<TracedCrossing>& factor, TracedCrossing& kept, int at,
                                SegmentCursor& cursor, int& queued) {
        const int count = static_cast<int>(task.count);
        EdgeSample& s = kept.sample;
        CrossingSample& curve = kept.curve;
        // Sample a point of the curve
        s = sample_curve(scene, task, at, cursor,
                         [&](EdgeSample& sample) { bend_to_crossing(scene, sample, curve); });
        s.weight = select(curve.reversed, -s.weight, s.weight);
        set_factor(task, kept, factor);
        // Find out what is in front of it
        Int plus = splat(0);
        if (any(s.active)) plus = nearer_beside(s, curve);
        Float contact[2];
        if (any(s.active)) s.active = reached_first(scene, s.active, curve, s.view.direction, contact);
        if (!any(s.active)) return;
        const Behind before =
            look_behind(scene, s, crossed_sides(curve), task.limits.transparent,
                        CrossedFields{{curve.side[0].face, curve.side[1].face}, {contact[0], contact[1]}});
        if (!any(s.active)) return;
        const auto start = [&](int k, const Closest& hit, Vec3 step) EG_INLINE_LAMBDA {
            queued = start_side(task, work, queued, s, lane_index() + at + (k == 0 ? 0 : count),
                                s.view.direction, hit, step, before);
        };
        start_on_both_sides(scene, s, curve, plus, start);
    }
    template <typename Mode>
    EG_INLINE static void blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                                 const TracedCrossing& traced, Vec3 color) {
        const EdgeSample& s = traced.sample;
        view_blocks(mode, scene, motion, s, color);
        crossing_blocks(mode, scene, motion, s.active, s, traced.curve, color);
    }
};

}  // namespace edgegrad::EDGEGRAD_ISA
