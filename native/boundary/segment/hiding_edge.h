// The edge of a segment as what hides light from x, for samples that start at the camera.
#pragma once

#include "boundary/segment/occluder.h"
#include "boundary/segment/segment.h"
#include "boundary/segment/silhouette.h"

namespace edgegrad::EDGEGRAD_ISA {

// A segment's edge as what hides light from x.
struct HidingEdge {
    Vec3 across;  // t x w
    Mask clear;   // transparent faces, with a jump of transmittance instead of a side sigma
};

// Sets the segment's sweep, and drops edges that hide nothing from x.
EG_INLINE HidingEdge hide_behind(const SceneView& scene, const SegmentSample& p, const SurfacePoint& x,
                                 BoundarySegment& s) {
    const HidingEdge edge{cross(s.towards, p.t), transparent_occluder(scene, s.active, s.edge)};
    const Float sigma = select(edge.clear, splat(1.0f), occluder_side(scene, p, edge.across));
    s.sweep = edge.across * sigma;
    s.active &= (sigma != 0.0f) & ~on_edge_face(scene, p, x);
    // If x is closer to the edge than rounding, the jump is part of the primary term (derivations, F3c).
    s.active &= s.reach > 1e-5f * largest_component(s.point);
    return edge;
}

// Prepares the color of a sample for its motion (divide_slide), with the jump of transparent faces.
EG_INLINE void color_of_jump(const SceneView& scene, const SegmentSample& p, const HidingEdge& edge,
                             BoundarySegment& s) {
    divide_slide(s);
    const Mask clear = edge.clear & s.active;
    if (any(clear))
        s.color = select(edge.clear, s.color * transparent_jump(scene, p, clear, s.u, edge.across, s.towards),
                         s.color);
}

}  // namespace edgegrad::EDGEGRAD_ISA
