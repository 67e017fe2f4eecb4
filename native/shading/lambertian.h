// The Lambertian surface, f = albedo / pi: what most surfaces of a scene under reconstruction are.
#pragma once

#include "sampling/hemisphere.h"
#include "shading/bsdf/sample.h"
#include "texture/normal_map.h"

namespace edgegrad::EDGEGRAD_ISA {

struct Lambertian {
    Vec3 normal;  // shading normal, on the viewer's side
    Vec3 ng;      // the triangle's
    Vec3 albedo;
    const Vec3* smooth = nullptr;  // the smooth normal, where a normal map may have bent it
    bool mixed = false;            // samples half of the directions uniformly

    // Whether an emitter sample alone is good enough: f is as smooth as a cosine.
    static constexpr bool kSmooth = true;
    // Where light that falls on its back matters.
    EG_INLINE Mask both_sides() const { return splat(0); }

    // Turning the surface changes f |cos| by up to 1, whatever the cosine: divided by a density that vanishes
    // with it, that has no variance. Derivatives of what moves therefore sample half of the directions
    // uniformly.
    EG_INLINE Float pdf(Float cosine_density) const {
        return mixed ? 0.5f * cosine_density + 0.25f * kInvPi : cosine_density;
    }
    EG_INLINE Float shadowing(Vec3 w) const {
        return smooth ? bump_shadowing(*smooth, normal, w, splat(-1)) : splat(1.0f);
    }
    EG_INLINE BsdfValue evaluate(Mask active, Vec3 w) const {
        const Float density = select(active, max(dot(normal, w), 0.0f) * kInvPi, 0.0f);
        return {albedo * (density * shadowing(w)), pdf(density)};
    }
    // The same for light that only some kinds of rays (bits 1 << RayKind) see.
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
        s.specular = s.transmitted = s.followed = splat(0);
        s.half = normal;
        s.ray_kind = splat(static_cast<int>(kDiffuseRay));
        return s;
    }
};

}  // namespace edgegrad::EDGEGRAD_ISA
