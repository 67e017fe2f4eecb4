// One sample of the horizon term (boundary/terms/horizon.h): the light in the plane of a face F, the vertex x
// at which it arrives, and the side of the plane on which its path continues.
#pragma once

#include "boundary/segment/camera_subpath.h"
#include "boundary/segment/scattering_chain.h"
#include "boundary/segment/segment.h"
#include "tasks/dropped_samples.h"
#include "tasks/horizon_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// Light in the plane of F.
struct HorizonCut {
    Mask active;
    Int face, instance;  // F
    Float b1, b2;        // of x
    Vec3 position, normal;
    Vec3 towards;           // w
    Float distance;         // r, infinite for distant lights and the environment
    Float material_weight;  // 1 - b
    FarEnd y;
    Vec3 color;  // the integrand without n . (dy - m_F)/r
    // Lights that face x turn as x moves. Lanes in which the camera sees x, and its projection.
    Mask screen_form;
    Projection view;
};

struct HorizonSample {
    HorizonCut light, beyond;
    // How x moves if earlier vertices of the path are near contact. Only lights that turn with x need it, and
    // the first vertex' projection in light.view.
    FixedDirectionChain fixed;
};

// The fraction of samples that go on to a later vertex of the path, if the picture's depth allows.
constexpr float kLaterVertex = 0.4f;

// Chooses the number of the path's vertex x. Sets its probability.
EG_INLINE Int pick_vertex(const PathIndex& random, int most, Float& probability) {
    Float choice = sobol_pair(random, kPairChain).u;
    Int vertex = splat(1);
    probability = splat(1.0f);
    for (int k = 1; k < most; ++k) {
        const Mask here = vertex == k, later = here & (choice < kLaterVertex);
        choice = select(later, choice * (1.0f / kLaterVertex), choice);
        probability =
            select(here, probability * select(later, splat(kLaterVertex), 1.0f - kLaterVertex), probability);
        vertex = vertex - later;
        if (!any(later)) break;
    }
    return vertex;
}

// The side of F's plane on which the light's path continues: +1 for the viewer's side. If light counts on
// both sides, one is chosen at random, since they differ in occlusion. `weight` is the sign of the side over
// the probability.
struct HorizonSide {
    Float weight;
    Vec3 normal;  // towards that side
};

EG_INLINE HorizonSide pick_side(const ScatteringPoint& s, const PathIndex& random) {
    const Float choice = sobol_pair(random, kPairStrategy).u;
    const Mask back = s.both_sides & (choice < 0.5f);
    return {select(s.both_sides, select(back, splat(-2.0f), 2.0f), 1.0f),
            select(back, -s.x.normal, s.x.normal)};
}

// f |n_s . w| on that side, with the side's sign.
EG_OUTLINE Vec3 scattered_at_horizon(const SceneView& scene, const ScatteringPoint& s, Mask active,
                                     const HorizonSide& side, Vec3 w, Int kinds,
                                     const Followed& followed = splat(0.0f)) {
    return s.evaluate(scene, active, w + side.normal * splat(1e-4f), kinds, followed) * side.weight;
}

// The same times the path's throughput. Left out is what followed lobes alone contribute, whose throughput is
// `followed`, at x what is followed of the light: the specular term covers it
// (boundary/specular/chain_horizon.h).
EG_INLINE Vec3 brought_at_horizon(const SceneView& scene, const ScatteringPoint& s, Mask active,
                                  const HorizonSide& side, Vec3 w, Int kinds, Vec3 throughput, Vec3 followed,
                                  const Followed& of_light) {
    const Vec3 f = scattered_at_horizon(scene, s, active, side, w, kinds), all = f * throughput;
    const Mask left_out = active & (of_light.widest > 0.0f);
    if (!any(left_out)) return all;
    const Vec3 part = f - scattered_at_horizon(scene, s, left_out, side, w, kinds, of_light);
    // without_followed() needs positive values, but f has the sign of the side.
    const Vec3 rest = without_followed(all * side.weight, followed * part * side.weight) *
                      (1.0f / (side.weight * side.weight));
    return select(left_out, rest * side.weight, all);
}

EG_INLINE HorizonCut empty_cut(const SurfacePoint& x) {
    HorizonCut cut;
    cut.active = cut.screen_form = splat(0);
    cut.face = x.face, cut.instance = x.instance, cut.b1 = x.b1, cut.b2 = x.b2;
    cut.position = x.position, cut.normal = x.normal;
    cut.y = still_far_end();
    cut.color = zero3();
    cut.material_weight = splat(1.0f);
    return cut;
}

// Drops samples of infinite size. The color of all lanes without a sample is 0, so that its product with a
// velocity of 0 is finite.
EG_INLINE void keep_finite(const HorizonTask& task, const PathPacket& p, HorizonCut& cut) {
    const Float size = size_of(cut.color) / min(cut.distance, splat(1.0f));
    const Mask lost = cut.active & ~(size < kLargestSample);
    cut.active &= ~lost & (size > 0.0f);
    cut.color = select(cut.active, cut.color, zero3());
    if (!any(lost)) return;
    const PathIndex index = path_index(task.image, p.path);
    DroppedSamples& d = *task.dropped;
    for (int i = 0; i < W; ++i) {
        if (!lost[i]) continue;
        ++d.count;
        const int64_t pixel = task.image.first_pixel + index.pixel[i];
        if (pixel < d.first) d.first = pixel, d.place = cut.face[i], d.instance = cut.instance[i];
    }
}

// Samples a direction in F's plane: uniformly if light counts on both sides, else by the cosine to the
// projection of the shading normal.
EG_INLINE Vec3 plane_direction(const ScatteringPoint& s, Float u, Float& density) {
    const Vec3 n = s.x.normal, leans = s.normal - n * dot(n, s.normal);
    const Vec3 a = unit_vector(leans), b = cross(n, a);
    const Float side = 2.0f * u - 1.0f, middle = sqrt(max(1.0f - side * side, 0.0f));
    Float sine, cosine;
    sincos_turn(u, sine, cosine);
    sine = select(s.both_sides, sine, side);
    cosine = select(s.both_sides, cosine, middle);
    density = select(s.both_sides, splat(0.159154943f), 0.5f * middle);
    return a * cosine + b * sine;
}

}  // namespace edgegrad::EDGEGRAD_ISA
