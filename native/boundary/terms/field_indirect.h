// Indirect boundary term of distance fields: a field between two surfaces that light each other.
//
// The formula is that of shadows (boundary/terms/field_shadow.h), where L(y) is the radiance that y scatters,
// estimated by a path of the picture. The density of lines at a point is proportional to
// the normal curvature along them.
#pragma once

#include "boundary/segment/indirect_connection.h"
#include "boundary/segment/touched_field.h"

namespace edgegrad::EDGEGRAD_ISA {

// Samples the term without L(y) (connect_indirect).
EG_OUTLINE int sample_field_indirect(const SceneView& scene, const BoundaryTask& task,
                                     const DerivativeView& requested, int at, SegmentCursor& cursor,
                                     Workspace& work, int queued, BoundarySegment& s) {
    TouchingLine line;
    Float turn;
    const SegmentSample p = begin_on_field(scene, task, at, cursor, line, turn, s);
    s.active &= meets_field(scene, s, splat(kScatteredRays));
    if (!any(s.active)) return queued;
    touch_by_curvature(scene, turn, line, s);
    if (!any(s.active)) return queued;
    const auto find = [&](Int path) EG_INLINE_LAMBDA {
        LightSource y = meet_source(scene, s.active, line.exit.before, s.towards, line.exit.ignored,
                                    path_index(light_paths(task), path), task.limits.transparent);
        y.distance = select(y.hit.hit, y.hit.distance + line.exit.gap, 0.0f);
        return y;
    };
    const auto jump = [&]() EG_INLINE_LAMBDA {
        s.color = s.color * stopped_by_field(scene, s.active, field_of_line(scene, s.active, s.edge), s.point,
                                             line.at.normal, s.towards, kDiffuseRay);
    };
    return connect_indirect(scene, task, p, line.exit, requested, line.measure, at, work, queued, find, jump,
                            s);
}

}  // namespace edgegrad::EDGEGRAD_ISA
