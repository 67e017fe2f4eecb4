// How rays and emitter samples share the light that followed lobes (shading/bsdf/followed_lobes.h) show.
//
// A lobe narrower than a light meets it with normals whose slope m is up to about the light's angular radius.
// With larger slopes, in the lobe's tail, rays meet the light rarely, and their samples are large. Emitter
// samples find it there, and their scores, about 1/m, are small. So both share the light by a partition of
// unity in the microfacet normal (Veach 1997): rays by w = 1/(1 + (m/m_0)^4), emitter samples by 1 - w. At a
// fixed normal w is constant, so that it needs no derivative along rays.
#pragma once

#include "simd/vector.h"

namespace edgegrad::EDGEGRAD_ISA {

// What scan lines and rays find of a light: lobes up to an alpha, without their tails.
struct Followed {
    Float widest;
    Float tail;  // 1/theta^2 of the light (tail_of_lobe); 0: they have no tail
    bool interfaces = true;

    EG_INLINE Followed(Float most = splat(0.0f), Float by_tail = splat(0.0f)) : widest(most), tail(by_tail) {}

    // The same for mirrors and coats alone.
    EG_INLINE Followed reflections() const {
        Followed out = *this;
        out.interfaces = false;
        return out;
    }
};

EG_INLINE Followed select(Mask m, const Followed& a, const Followed& b) {
    return {select(m, a.widest, b.widest), select(m, a.tail, b.tail)};
}

// The followed lobe that scattered a ray, and the squared slope of its normal; 0 for transmitted rays, whose
// lobes have no tail. alpha 0: any other lobe.
struct RayLobe {
    Float alpha = splat(0.0f), slope2 = splat(0.0f);
};

EG_INLINE RayLobe select(Mask m, const RayLobe& a, const RayLobe& b) {
    return {select(m, a.alpha, b.alpha), select(m, a.slope2, b.slope2)};
}

// 1/m_0^2 of a lobe, from that of the light. Rays of a lobe that is much narrower than the light have slopes
// near the light's radius only with a probability of about (alpha/m)^2. There emitter samples have less
// variance from (2 m)^4 = alpha theta^2 on (derivations, Q).
EG_INLINE Float tail_of_lobe(Float tail, Float alpha) {
    return max(tail, 4.0f * sqrt(tail / max(detach(alpha), splat(1e-6f))));
}

// The share of a light that rays of a lobe meet.
EG_INLINE Float share_of_rays(const RayLobe& lobe, const Followed& limits) {
    const Float by_tail = lobe.slope2 * tail_of_lobe(limits.tail, lobe.alpha);
    return select(lobe.alpha <= limits.widest, 1.0f / (1.0f + by_tail * by_tail), 0.0f);
}

// The part of that share at surfaces that throw the light (path/lights/thrown_light.h). It vanishes in the
// plane of the face, which light reaches with this cosine.
EG_INLINE Float share_above(Float cosine) {
    constexpr float kFull = 0.004f;
    const Float t = min(max(cosine * (1.0f / kFull), 0.0f), splat(1.0f));
    return t * t * (3.0f - 2.0f * t);
}

// The share of the density of normals h that is left to emitter samples.
EG_INLINE Float share_of_emitter_samples(Vec3 h, Float tail) {
    const Float across = (h.x * h.x + h.y * h.y) * tail, along = h.z * h.z;
    const Float tails = across * across;
    return tails / max(along * along + tails, 1e-30f);
}

}  // namespace edgegrad::EDGEGRAD_ISA
