// The phase function of media (Henyey and Greenstein 1941),
//   p(cos) = (1 - g^2) / (4 pi (1 + g^2 - 2 g cos)^(3/2)),
// with the cosine between the light's directions before and after, whose mean is g. A scattering event takes
// the place of a surface in path/scatter.h, where the phase function stands for f |cos|.
#pragma once

#include "sampling/hemisphere.h"
#include "shading/bsdf/sample.h"

namespace edgegrad::EDGEGRAD_ISA {

// The mean cosine of a medium with the scattering and MediumFloat kMediumForward.
EG_INLINE Float mean_cosine(Vec3 scattering, Float forward) {
    const Float mean = (scattering.x + scattering.y + scattering.z) * (1.0f / 3.0f);
    const Float cosine = select(mean > 0.0f, forward / max(mean, 1e-30f), splat(0.0f));
    return min(max(cosine, splat(-0.999f)), splat(0.999f));
}

struct PhaseFunction {
    Vec3 normal;  // against the ray; it has no effect
    Vec3 along;   // unit: the direction in which the path arrives
    Float cosine;

    static constexpr bool kSmooth = false;
    EG_INLINE Mask both_sides() const { return splat(-1); }

    EG_INLINE Float density(Vec3 w) const {
        const Float base = max(1.0f + cosine * cosine - 2.0f * cosine * dot(along, w), 1e-12f);
        return (1.0f - cosine * cosine) * (0.25f * kInvPi) / (base * sqrt(base));
    }
    EG_INLINE BsdfValue evaluate(Mask active, Vec3 w) const {
        const Float p = select(active, density(w), 0.0f);
        return {gray(p), p};
    }
    // The same for light that is visible only to rays of some kinds (bits 1 << RayKind).
    EG_INLINE BsdfValue evaluate_for(Int kinds, Mask active, Vec3 w) const {
        BsdfValue f = evaluate(active, w);
        f.value = select((kinds & (1 << meets_as(kMediumRay))) != 0, f.value, zero3());
        return f;
    }
    EG_INLINE BsdfSample sample(Mask active, Float, Float u, Float v) const {
        // Invert the distribution of the cosine; near g = 0 it is uniform
        const Float ratio = (1.0f - cosine * cosine) / (1.0f - cosine + 2.0f * cosine * u);
        const Mask even = abs(cosine) < 1e-3f;
        const Float skewed =
            (1.0f + cosine * cosine - ratio * ratio) / select(even, splat(1.0f), 2.0f * cosine);
        const Float c = min(max(select(even, 2.0f * u - 1.0f, skewed), splat(-1.0f)), splat(1.0f));
        BsdfSample s;
        s.wi = direction_at(along, c, v);
        s.active = active;
        s.pdf = density(s.wi);
        s.weight = one3();
        s.lobe = splat(0);
        s.specular = s.transmitted = splat(0);
        s.half = normal;
        s.ray_kind = splat(kMediumRay);
        return s;
    }
};

}  // namespace edgegrad::EDGEGRAD_ISA
