// Light that perfect lobes bend before it reaches another surface, followed from its end backwards: from the
// last vertex m of a camera path's chain, m = m_K, over m_(K-1), ..., m_1 to the surface x whose other lobes
// scatter it. A camera path meets these vertices in the reverse order.
//
// Lines have the measure dA |n.w| dw. A perfect lobe maps the directions w, towards the light, to v, towards
// x, at a fixed place. A reflection keeps dw, also that of a microfacet with a fixed normal. For a refraction
// n_v^2 |h.v| dv = n_w^2 |h.w| dw, with h the normal of the lobe and the indices n_v and n_w on both sides.
// The normal n of the face differs from h if shading normals do. So
//   dA |n.v| dv = dA |n.w| dw * |n.v|/|n.w| * (1 or (n_w/n_v)^2 |h.w|/|h.v|).
#pragma once

#include "boundary/segment/receiver.h"
#include "boundary/segment/scattering_chain.h"
#include "boundary/specular/chain.h"
#include "tasks/boundary_task.h"

namespace edgegrad::EDGEGRAD_ISA {

struct BentLight {
    Int count;  // K, of lanes that have reached x
    // The vertices from m on: their places, closures and events.
    Int face[kMostChain], mesh[kMostChain], instance[kMostChain];
    Int closure[kMostChain], event[kMostChain];
    Float b1[kMostChain], b2[kMostChain];
    Vec3 half;  // the microfacet normal of m's event, if m throws the light by a narrow lobe
    Closest x;
    Vec3 along;   // the direction of the light that arrives at x
    Vec3 weight;  // change of the measure, over the probability of the choices
};

// The probability of ending at a surface that has both perfect and other lobes, or several closures.
constexpr float kBentLightEnds = 0.5f;

// The factor of the measure at a vertex with the face's normal n. `eta` is the index on the side of v over
// that on the side of w.
EG_INLINE Float bent_measure(Vec3 n, Vec3 v, Vec3 w, Mask transmitted, Float eta) {
    const Float faces = abs(dot(n, v)) / max(abs(dot(n, w)), 1e-20f);
    const Mask bends = transmitted & ~bends_nothing(eta);
    const Float inverse = 1.0f / eta;  // n_w / n_v
    const Vec3 h = v + w * inverse;    // not normalised
    const Float cosines = abs(dot(h, w)) / max(abs(dot(h, v)), 1e-20f);
    return select(bends, faces * (inverse * inverse * cosines), faces);
}

// Follows light that arrives along -w at `hit`, the last vertex of a chain of at most `most` vertices.
// Lanes of `throws`: m may also throw it by a narrow lobe (path/lights/thrown_light.h), and is then the only
// vertex.
EG_OUTLINE BentLight follow_bent_light(const SceneView& scene, const PathIndex& random, Mask active,
                                       const Closest& hit, Vec3 w, int most, Mask throws) {
    BentLight out;
    out.count = splat(0);
    out.x = hit;
    out.x.hit = splat(0);
    out.along = -w;
    out.weight = one3();
    const UInt stream = hash(random.stream ^ hash(random.sample + splat(0x51ed270bu)));
    const Int kind = splat(kDiffuseRay);
    Closest at = hit;
    Mask going = active, thrown = splat(0);
    for (int level = 0; level <= most && any(going); ++level) {
        const Vec3 travels = out.along, back = -travels;
        const SurfacePoint s = hit_surface(scene, going, at, travels);
        going &= s.active;
        // Find the perfect lobes of one closure, as seen from the light
        const TexturePoint point = texture_point(scene, s, back, kind);
        Float sum;
        const Int closure = pick_closure(scene, s, point, chain_random(stream, level, 0), sum);
        const ChainSurface surface = chain_surface(scene, s, point, select(going, closure, splat(0)));
        const Vec3 normal = shading_normal(scene, going, surface.shader, point);
        const Bsdf f = shaded_surface(scene, going, s, point, surface.shader, normal).bsdf;
        Float probability = 1.0f / max(sum, 1e-30f);
        probability =
            select(surface.closure_weight > 0.0f, probability * surface.closure_weight, probability);
        PerfectLobes lobes;
        perfect_values(f, going, lobes);
        if (level == 0 && any(throws)) {
            Bsdf narrow = f;
            follow_lobes(narrow, throwing_lobes(f, going & throws, splat(scene.thrown_alpha)));
            followed_values(narrow, going, chain_random(stream, level, 1), chain_random(stream, level, 3),
                            lobes);
        }
        const LobeSum perfect = sum_of(lobes);
        Vec3 half = normal;
        const Int event =
            choose_lobe(lobes, perfect, going, chain_random(stream, level, 2), probability, half);
        // End here or go on. Of a material of several closures the choice must not depend on the picked one.
        if (level > 0) {
            const Mask bends = may_have(scene, s, going, kHasGlossy | kHasRefraction);
            const Int closures = closure_count(scene, s.material);
            const Float alone =
                select(perfect.value > 0.0f, select(has_wide_lobes(f, going), splat(kBentLightEnds), 0.0f),
                       splat(1.0f));
            Float chance = select(closures > 1, splat(kBentLightEnds), alone);
            if (level == most) chance = splat(1.0f);
            chance = select(bends & ~thrown, chance, splat(1.0f));
            const Mask ends = going & (chain_random(stream, level, 1) < chance);
            out.weight = select(ends, out.weight * (1.0f / max(chance, 1e-6f)), out.weight);
            probability = probability * (1.0f - chance);
            out.count = select(ends, splat(level), out.count);
            out.x.hit |= ends;
            out.x.face = select(ends, at.face, out.x.face), out.x.mesh = select(ends, at.mesh, out.x.mesh);
            out.x.instance = select(ends, at.instance, out.x.instance);
            out.x.b1 = select(ends, at.b1, out.x.b1), out.x.b2 = select(ends, at.b2, out.x.b2);
            out.x.distance = select(ends, at.distance, out.x.distance);
            going &= ~ends;
        }
        if (level == most) break;
        going &= (event != kEventEnds) & ((gather(scene.mesh_mask, s.mesh) & kScatteredRays) != 0);
        if (!any(going)) break;
        // Bend the light
        const Mask transmitted = going & ((event & kEventTransmits) != 0);
        Float shown;
        RayLobe lobe;
        const Vec3 v = scatter_by_event(scene, surface, going, event, transmitted, half, shown, lobe).wi;
        const Float side = dot(s.normal, v);
        going &= select(transmitted, side < 0.0f, side > 0.0f);
        out.weight = select(going,
                            out.weight * (bent_measure(s.normal, v, back, transmitted, f.glass.eta) /
                                          max(probability, 1e-30f)),
                            out.weight);
        out.face[level] = at.face, out.mesh[level] = at.mesh, out.instance[level] = at.instance;
        out.b1[level] = at.b1, out.b2[level] = at.b2;
        out.closure[level] = closure, out.event[level] = event;
        if (level == 0) out.half = half, thrown = going & ((event & kEventFollows) != 0);
        out.along = select(going, v, out.along);
        // Find the next surface
        const Int all = splat(kScatteredRays);
        const ReceiverHit next = find_receiver(
            scene, going, leave_surface(s, v), -v, ignore_nothing(),
            {all, splat(kScatteredRays | 1 << kCameraRay), kDiffuseRay, splat((64 + level) * kChainVertex)},
            random);
        going &= next.found;
        at = next.hit;
        out.weight = select(going, out.weight * next.through, out.weight);
    }
    return out;
}

}  // namespace edgegrad::EDGEGRAD_ISA
