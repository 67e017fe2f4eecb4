// Whether a path continues at a surface, and where its next ray starts.
#pragma once

#include "path/path_queue.h"
#include "scene/rays/rays.h"
#include "tasks/image_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// Origin of a ray that leaves the surface in direction w.
EG_INLINE Vec3 leave_surface(const SurfacePoint& x, Vec3 w) {
    return x.position + x.normal * select(dot(x.normal, w) < 0.0f, -x.offset, x.offset);
}

EG_INLINE Int limit(const BounceLimits& limits, Int kind) {
    return select(kind == splat(static_cast<int>(kDiffuseRay)), splat(limits.diffuse),
                  select(kind == splat(static_cast<int>(kGlossyRay)), splat(limits.glossy),
                         splat(limits.transmission)));
}

// Whether a ray that leaves by a bounce of `kind` is the last ray of its path.
EG_INLINE Mask next_is_final(const ImageTask& task, const PathPacket& p, Int kind) {
    return (p.segment + 1 >= task.max_depth) | (bounce_count(p.bounces, kind) + 1 > limit(task.limits, kind));
}

}  // namespace edgegrad::EDGEGRAD_ISA
