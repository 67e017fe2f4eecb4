// Primary boundary term of distance fields: the outline of a field sweeps over the picture.
//
// The outline is where the camera's rays are tangent to the surface (sdf/outline_point.h). Along a segment of
// it, x(u) is solved for, and the rest is as for edges (boundary/terms/primary.h):
//   dI = int du (L- - L+) kappa N . (de - c),    N = D x dx/du.
// N is parallel to the surface's normal. So only the normal velocity of the surface counts,
// -dphi / |grad phi| for a change dphi of the field: N . de = -(N . grad phi) dphi / |grad phi|^2. On the
// side of the surface the radiance is that of the point itself, seen along its tangent plane; on the other
// side it is that of what the ray meets behind it.
#pragma once

#include "boundary/fields/field_viewer.h"
#include "boundary/samples/outline_samples.h"
#include "boundary/terms/primary.h"

namespace edgegrad::EDGEGRAD_ISA {

// The point of a field's surface that each sample sees on one side.
struct OutlineSample {
    Closest hit;    // of the field, at the point
    Vec3 normal;    // out of the surface
    Vec3 grazing;   // the direction of the ray, in the tangent plane
    Mask minus;     // the surface is on the side against the sample's normal
    Float contact;  // the length before and behind the point over which hits of the field do not count
};

// Moves the sample from its segment to the outline. `reversed`: lanes where the outline runs back.
EG_OUTLINE void bend_to_outline(const SceneView& scene, EdgeSample& s, OutlineSample& out, Mask& reversed) {
    out.hit.hit = s.active;
    out.hit.face = out.hit.mesh = reversed = splat(0);
    out.hit.instance = splat(-1);
    out.hit.b1 = out.hit.b2 = out.hit.distance = out.contact = splat(0.0f);
    out.normal = {splat(0.0f), splat(0.0f), splat(1.0f)};
    const auto camera = [&](int i, const FieldView& field) {
        LensPlace lens = {0.0f, 0.0f};
        if (scene.line_lens) {
            const float* at = scene.line_lens + 2 * scene.intersection(s.edge[i]);
            lens = {at[0], at[1]};
        }
        return camera_viewer(field, scene.camera, lens);
    };
    for_each_outline_point(scene, s.active, s.edge, s.u, camera,
                           [&](int i, const FieldView& field, const OutlinePoint& p) {
                               set_lane3(s.point, i, p.position);
                               set_lane3(s.tangent, i, p.tangent);
                               set_lane3(out.normal, i, p.normal);
                               set_place(field, p.grid, i, out.hit.b1, out.hit.b2);
                               reversed[i] = p.reversed ? -1 : 0;
                               out.contact[i] = p.contact;
                           });
    out.hit.face = field_of_line(scene, s.active, s.edge);
}

// Samples a point of the outline.
EG_INLINE EdgeSample sample_outline(const SceneView& scene, const BoundaryTask& task, int at,
                                    SegmentCursor& cursor, OutlineSample& out) {
    Mask reversed;
    EdgeSample s = sample_curve(scene, task, at, cursor,
                                [&](EdgeSample& sample) { bend_to_outline(scene, sample, out, reversed); });
    s.weight = select(reversed, -s.weight, s.weight);
    out.grazing = s.view.direction;
    out.minus = dot(s.normal, out.normal) > 0.0f;
    return s;
}

// Samples of outlines, as MeshCurves for edges. sample(scene, task, at, cursor, outline) returns the samples
// [task.first + at, ...).
template <auto sample>
struct OutlineSides {
    using Traced = TracedSample;

    EG_INLINE static void start(const SceneView& scene, const BoundaryTask& task, Workspace& work,
                                const FactorOf<TracedSample>& factor, TracedSample& kept, int at,
                                SegmentCursor& cursor, int& queued) {
        const int count = static_cast<int>(task.count);
        const SideFace none = {splat(-1), splat(-1), splat(0), splat(0.0f)};
        EdgeSample& s = kept.sample;
        OutlineSample outline;
        s = sample(scene, task, at, cursor, outline);
        set_factor(task, kept, factor);
        // Find the surface behind
        Behind behind;
        if (any(s.active))
            behind = look_behind(scene, s, {none, none, splat(0)}, task.limits.transparent,
                                 GrazedField{outline.hit.face, outline.contact});
        if (!any(s.active)) return;
        // Start a path on each side
        Closest hit = outline.hit;
        hit.hit = s.active;
        hit.mesh = mesh_of(scene, select(s.active, hit.face, splat(0)));
        hit.distance = s.view.distance;
        const Vec3 direction = onto_surface(outline.grazing, outline.normal);
        const Int plus_path = lane_index() + at, minus_path = plus_path + count;
        const auto start = [&](Int number, Vec3 along, const Closest& first) EG_INLINE_LAMBDA {
            queued = start_side(task, work, queued, s, number, along, first, zero3(), behind);
        };
        start(select(outline.minus, minus_path, plus_path), direction, hit);
        start(select(outline.minus, plus_path, minus_path), s.view.direction, behind.hit);
    }
};

struct FieldCurves : OutlineSides<sample_outline> {
    template <typename Mode>
    EG_INLINE static void blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                                 const TracedSample& traced, Vec3 color) {
        const EdgeSample& s = traced.sample;
        view_blocks(mode, scene, motion, s, color);
        if (!motion.fields.any() || motion.warped) return;  // else the warp has them
        mode.field(s.active, field_of_line(scene, s.active, s.edge), s.point, s.normal * s.weight, color);
    }
};

}  // namespace edgegrad::EDGEGRAD_ISA
