// Where and whether a path goes on from a surface.
#pragma once

#include "path/path_queue.h"
#include "scene/rays/rays.h"
#include "tasks/image_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// Where a ray towards w leaves the surface.
EG_INLINE Vec3 leave_surface(const SurfacePoint& x, Vec3 w) {
    return x.position + x.normal * select(dot(x.normal, w) < 0.0f, -x.offset, x.offset);
}

EG_INLINE Int limit(const BounceLimits& limits, Int kind) {
    return select(kind == splat(static_cast<int>(kDiffuseRay)), splat(limits.diffuse),
                  select(kind == splat(static_cast<int>(kGlossyRay)), splat(limits.glossy),
                         splat(limits.transmission)));
}

// Whether the ray that leaves for the next surface by a bounce of `kind` is a path's last.
EG_INLINE Mask next_is_final(const ImageTask& task, const PathPacket& p, Int kind) {
    return (p.segment + 1 >= task.max_depth) | (bounce_count(p.bounces, kind) + 1 > limit(task.limits, kind));
}

}  // namespace edgegrad::EDGEGRAD_ISA
