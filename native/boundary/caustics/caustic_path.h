// Caustics: a surface x that is not perfectly smooth is lit by way of perfect mirrors and smooth glass, m_1
// to m_K, and the radiance along the last ray, from m_K, jumps where the ray touches a curve (derivations,
// S). Samples start at the curve. Their light is followed to x (boundary/caustics/bent_light.h) and on to the
// camera. The path that arrives there is stored, to be replayed from the camera and recorded
// (boundary/specular/chain_term.h).
#pragma once

#include "boundary/caustics/bent_light.h"
#include "boundary/segment/scattering_chain.h"
#include "tasks/scan_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// Whether paths of so many bounces may bend once more at each vertex of the chain but the last. The camera's
// bounces are those up to x.
EG_INLINE Mask may_bend(const BoundaryTask& task, Mask active, const BentLight& light, Int bounces) {
    if (!limits_matter(task.limits, task.max_depth)) return active;
    for (int level = kMostChain - 1; level > 0; --level) {
        const Mask here = active & (level < light.count);
        if (!any(here)) continue;
        const Int kind =
            select((light.event[level] & kEventTransmits) != 0, splat(kTransmissionRay), splat(kGlossyRay));
        bounces = add_bounce(bounces, here, kind);
    }
    return active & within_limits(task.limits, bounces);
}

// Appends the path of lane i: the surfaces from the camera to x, then the chain to the light.
EG_INLINE void append_caustic(ChainCrossings& c, int n, int i, int64_t sample, const ChainPlaces& places,
                              int length, const BentLight& light) {
    int level = 0;
    const auto put = [&](const auto& from, int k, int32_t closure, int32_t event) {
        c.face[level][n] = from.face[k][i], c.mesh[level][n] = from.mesh[k][i];
        c.instance[level][n] = from.instance[k][i];
        c.b1[level][n] = from.b1[k][i], c.b2[level][n] = from.b2[k][i];
        c.closure[level][n] = closure, c.event[level][n] = event;
        for (auto& part : c.half) part[level][n] = 0.0f;
        ++level;
    };
    for (int k = length; k >= 0; --k) put(places, k, 0, kEventAims);
    for (int k = light.count[i] - 1; k >= 0; --k) put(light, k, light.closure[k][i], light.event[k][i]);
    if (light.event[0][i] & kEventFollows) {
        c.half[0][level - 1][n] = light.half.x[i], c.half[1][level - 1][n] = light.half.y[i];
        c.half[2][level - 1][n] = light.half.z[i];
    }
    c.length[n] = level;
    c.segment[n] = static_cast<int32_t>(sample);
    c.parted[n] = c.lit[n] = c.horizontal[n] = c.edge_instance[n] = 0;
    c.weight[n] = 1.0f;
    c.outlined_light[n] = c.edge[n] = c.field[n] = c.crossed_face[0][n] = c.crossed_face[1][n] = -1;
    c.u[n] = c.contact[n] = 0.0f;
}

// The largest number of surfaces of such a path, without the first.
EG_INLINE int most_of_caustic(const BoundaryTask& task) {
    return task.max_depth - 2 < kMostChain ? task.max_depth - 2 : kMostChain - 1;
}

// Follows the light of samples from m_K, where it arrives along -w, to the camera. `weight` is the measure of
// a sample over its density. Stores the paths of lanes accept(i, light, length) and calls curve(i, n) for
// each. Returns the number of stored paths.
template <typename Accept, typename Curve>
EG_OUTLINE int follow_caustic(const SceneView& scene, const BoundaryTask& task, const SegmentSample& p,
                              Mask active, const Closest& m, Vec3 w, Vec3 weight, int64_t at,
                              ChainCrossings& out, int found, const Accept& accept, const Curve& curve) {
    // Follow the light to x
    const int most = most_of_caustic(task);
    const Mask throws = splat(scene.thrown_alpha > 0.0f ? -1 : 0);
    const BentLight light = follow_bent_light(scene, p.random, active, m, w, most, throws);
    Float probability;
    const Int length = chain_length(p, task.max_depth - 3, probability);
    const Int seers = select(length > 0, splat(kScatteredRays), splat(1 << kCameraRay));
    active &= light.x.hit & (length + light.count <= most) &
              ((gather(scene.mesh_mask, select(light.x.hit, light.x.mesh, splat(0))) & seers) != 0);
    for (int i = 0; i < W; ++i)
        if (active[i] && !accept(i, light, length[i])) active[i] = 0;
    if (!any(active)) return found;
    // Follow it to the camera
    ChainPlaces places;
    const SeenLight seen =
        see_light(scene, task, p, active, light.x, light.along, length, splat(kScatteredRays), true, splat(0),
                  splat(scene.followed_alpha), &places, splat(0.0f), scene.least_alpha > 0.0f);
    active &= seen.active;
    if (!any(active)) return found;
    active = may_bend(task, active, light, seen.bounces);
    const SurfacePoint x = hit_surface(scene, active, light.x, seen.view.direction);
    const Float facing = select(length == 0, abs(dot(x.normal, seen.view.across_of)), splat(1.0f));
    const Vec3 color =
        weight * light.weight * seen.weight * (facing * (task.scale / max(probability, 1e-30f)));
    Float lens_u, lens_v;
    sobol_pair(p.random.stream, p.random.sample, kPairLens, lens_u, lens_v);
    for (int i = 0; i < W; ++i) {
        if (!active[i]) continue;
        append_caustic(out, found, i, at + i, places, length[i], light);
        out.x[found] = seen.view.sx[i], out.y[found] = seen.view.sy[i];
        out.lens_u[found] = lens_u[i], out.lens_v[found] = lens_v[i];
        out.curve_point[0][found] = color.x[i], out.curve_point[1][found] = color.y[i];
        out.curve_point[2][found] = color.z[i];
        curve(i, found++);
    }
    return found;
}

}  // namespace edgegrad::EDGEGRAD_ISA
