// The Lambertian surface, f = albedo / pi.
#pragma once

#include "sampling/hemisphere.h"
#include "shading/bsdf/sample.h"
#include "texture/normal_map.h"

namespace edgegrad::EDGEGRAD_ISA {

struct Lambertian {
    Vec3 normal;  // shading normal, on the viewer's side
    Vec3 ng;      // geometric normal
    Vec3 albedo;
    const Vec3* smooth = nullptr;  // the smooth normal, if a normal map may have bent it
    bool mixed = false;            // samples half of the directions uniformly

    // Whether emitter samples alone find the light of surfaces well: the BSDF has no peaks.
    static constexpr bool kSmooth = true;
    // Lanes for which light from behind the surface contributes.
    EG_INLINE Mask both_sides() const { return splat(0); }

    // The derivative of f |cos| by the normal does not vanish at grazing angles, where the density of cosine
    // sampling does; its estimate then has infinite variance. Paths for geometric derivatives therefore
    // sample half of the directions uniformly.
    EG_INLINE Float pdf(Float cosine_density) const {
        return mixed ? 0.5f * cosine_density + 0.25f * kInvPi : cosine_density;
    }
    EG_INLINE Float shadowing(Vec3 w) const {
        return smooth ? bump_shadowing(*smooth, normal, w) : splat(1.0f);
    }
    EG_INLINE BsdfValue evaluate(Mask active, Vec3 w) const {
        const Float density = select(active, max(dot(normal, w), 0.0f) * kInvPi, 0.0f);
        return {albedo * (density * shadowing(w)), pdf(density)};
    }
    // The same for light that is visible only to rays of some kinds (bits 1 << RayKind).
    EG_INLINE BsdfValue evaluate_for(Int kinds, Mask active, Vec3 w) const {
        BsdfValue f = evaluate(active, w);
        f.value = select((kinds & (1 << kDiffuseRay)) != 0, f.value, zero3());
        return f;
    }
    EG_INLINE BsdfSample sample(Mask active, Float, Float u, Float v) const {
        BsdfSample s;
        s.wi = mixed ? mixed_direction(normal, u, v) : cosine_direction(normal, u, v);
        const Float density = max(dot(normal, s.wi), 0.0f) * kInvPi;
        s.active = active & (dot(ng, s.wi) > 0.0f);
        s.pdf = pdf(density);
        s.weight = albedo * shadowing(s.wi) * (mixed ? density / s.pdf : splat(1.0f));
        s.lobe = splat(0);
        s.specular = s.transmitted = splat(0);
        s.half = normal;
        s.ray_kind = splat(kDiffuseRay);
        return s;
    }
};

}  // namespace edgegrad::EDGEGRAD_ISA
