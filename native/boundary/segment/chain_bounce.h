// The bounces of camera paths at the surfaces of a boundary sample. Where kinds of bounces matter
// (path/bounces.h), light that several kinds of lobes scatter counts as that of one of them, chosen at
// random.
#pragma once

#include "path/bounces.h"
#include "path/path_queue.h"
#include "path/stream.h"
#include "tasks/boundary_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// The kinds of scattered light that diffuse lobes have.
constexpr int32_t kSoftKinds = 1 << kDiffuseRay | kOfTable;

// The kind of bounce by which a camera path continues from x to w, with x seen from the side of its normal.
// Lanes of `soft` are scattered by diffuse lobes.
EG_INLINE Int bounce_kind(const SurfacePoint& x, Vec3 w, Mask soft) {
    const Int above = select(soft, splat(kDiffuseRay), splat(kGlossyRay));
    return select(dot(x.normal, w) < 0.0f, splat(kTransmissionRay), above);
}

// The same, chosen at random. `diffuse` is the part of the scattered light `all` that is due to diffuse
// lobes.
EG_INLINE Int bounce_kind(const SurfacePoint& x, Vec3 w, Vec3 all, Vec3 diffuse, Float choice) {
    return bounce_kind(x, w, choice * largest_component(all) < largest_component(diffuse));
}

// Whether a path with these bounces may scatter once more.
EG_INLINE Mask within_limits(const BounceLimits& limits, Int bounces) {
    return ((bounces & 255) <= limits.diffuse) & (((bounces >> 8) & 255) <= limits.glossy) &
           (((bounces >> 16) & 255) <= limits.transmission) & ~finds_ambient(limits, bounces);
}

// Whether paths may continue after lobes of `kinds` scatter them at x towards w; counts the bounce. `vertex`
// selects the random numbers of x, and evaluate(kinds) returns the value of lobes.
template <typename Value>
EG_INLINE Mask scatters_within_limits(const SceneView& scene, const BoundaryTask& task, Mask active,
                                      const SurfacePoint& x, Vec3 w, Int kinds, const PathIndex& random,
                                      Int vertex, const Value& evaluate, Int& bounces) {
    if (!kinds_matter(scene, task.limits, task.max_depth) || !any(active)) return active;
    const Float choice = sobol_pair(random, vertex_pair(vertex, kVertexSurvival)).u;
    const Vec3 all = evaluate(kinds), diffuse = evaluate(kinds & kSoftKinds);
    bounces = add_bounce(bounces, active, bounce_kind(x, w, all, diffuse, choice));
    return active & within_limits(task.limits, bounces);
}

// A choice between the light of diffuse lobes and that of all others.
struct PickedBounce {
    Mask soft;      // the diffuse lobes were chosen
    Float inverse;  // of the probability of the choice

    EG_INLINE Vec3 of(Vec3 by_soft, Vec3 by_others) const {
        return select(soft, by_soft, by_others) * inverse;
    }
};

EG_INLINE PickedBounce pick_bounce(Vec3 by_soft, Vec3 by_others, Float choice) {
    const Float soft = largest_component(by_soft), sum = soft + largest_component(by_others);
    const Float chance = select(sum > 0.0f, soft / max(sum, 1e-30f), 0.0f);
    PickedBounce r;
    r.soft = choice < chance;
    r.inverse = 1.0f / max(select(r.soft, chance, 1.0f - chance), 1e-20f);
    return r;
}

}  // namespace edgegrad::EDGEGRAD_ISA
