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
    return select(kind == splat(kDiffuseRay), splat(limits.diffuse),
                  select(kind == splat(kGlossyRay), splat(limits.glossy), splat(limits.transmission)));
}

// Whether a path with these bounces has reached the limit `ambient`.
EG_INLINE Mask finds_ambient(const BounceLimits& limits, Int bounces) {
    if (limits.ambient >= 255) return splat(0);
    const Int diffuse = bounces & 255, glossy = (bounces >> 8) & 255;
    return diffuse + glossy - ((glossy > 0) & 1) >= limits.ambient;
}

// Whether the bounce limits may end paths before the depth limit does.
EG_INLINE bool limits_matter(const BounceLimits& limits, int max_depth) {
    const int most = max_depth - 2;
    return limits.diffuse < most || limits.glossy < most || limits.transmission < most ||
           limits.ambient < 255;
}

// The same, or whether surfaces scatter otherwise behind diffuse bounces than behind others.
EG_INLINE bool kinds_matter(const SceneView& scene, const BounceLimits& limits, int max_depth) {
    return scene.least_alpha > 0.0f || limits_matter(limits, max_depth);
}

// Whether a ray that leaves by a bounce of `kind` is the last ray of its path.
EG_INLINE Mask next_is_final(const ImageTask& task, const PathPacket& p, Int kind) {
    const Mask in_medium = kind == splat(kMediumRay);
    Mask last = (p.segment + 1 >= task.max_depth) |
                (~in_medium & (bounce_count(p.bounces, kind) + 1 > limit(task.limits, kind)));
    if (any(in_medium)) last |= in_medium & (medium_bounces(p) + 1 > task.limits.medium);
    if (task.limits.ambient >= 255) return last;
    const Mask scatters = p.active & (kind >= splat(kDiffuseRay)) & (kind <= splat(kTransmissionRay));
    return last | (scatters & finds_ambient(task.limits, add_bounce(p.bounces, scatters, kind)));
}

}  // namespace edgegrad::EDGEGRAD_ISA
