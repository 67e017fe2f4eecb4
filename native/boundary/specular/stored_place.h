// Where stored paths of caustics go on (boundary/caustics/caustic_path.h): the replay compares its rays with
// these places.
#pragma once

#include "boundary/samples/segment_sampling.h"
#include "boundary/specular/chain_surface.h"
#include "path/bounces.h"
#include "tasks/scan_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// The place of the vertex at a level of crossings [at, at + W).
EG_OUTLINE Vec3 stored_place(const SceneView& scene, const ChainCrossings& c, int at, Mask active,
                             int level) {
    Closest hit;
    hit.hit = active;
    hit.face = select(active, load(c.face[level] + at), splat(0));
    hit.instance = select(active, load(c.instance[level] + at), splat(-1));
    hit.b1 = select(active, load(c.b1[level] + at), 0.0f);
    hit.b2 = select(active, load(c.b2[level] + at), 0.0f);
    return hit_position(scene, active, hit, placed_triangle(scene, hit.face, hit.instance));
}

// The kind of bounce by which paths go on from a surface: any is possible, but where lobes are wider behind
// diffuse bounces, none behind these is as narrow as those of caustics.
EG_INLINE Int aimed_kind(const SceneView& scene) {
    return splat(static_cast<int>(scene.least_alpha > 0.0f ? kGlossyRay : kDiffuseRay));
}

// The ray from a surface towards a point.
EG_INLINE ChainRay ray_to(const SceneView& scene, const SurfacePoint& x, Vec3 to) {
    const Vec3 w = unit_vector(to - x.position);
    return {leave_surface(x, w), w, x.position, aimed_kind(scene), splat(0.0f)};
}

// Whether a replayed ray goes to a point, up to rounding.
EG_INLINE Mask points_at(const ChainRay& ray, Vec3 to) {
    const Vec3 off = unit_vector(to - ray.from) - ray.direction;
    return dot(off, off) < 1e-5f;
}

// The points of the edges of crossings [at, at + W).
EG_OUTLINE Vec3 stored_edge_point(const SceneView& scene, const ChainCrossings& c, int at, Mask active) {
    Vec3 end, tangent;
    gather_edges(scene, select(active, load(c.edge + at), splat(0)),
                 select(active, load(c.edge_instance + at), splat(-1)), end, tangent);
    return end + tangent * select(active, load(c.u + at), 0.0f);
}

}  // namespace edgegrad::EDGEGRAD_ISA
