// The rim of the transmission lobe, where refraction ends with a discontinuity.
//
// Light from w is refracted towards the view v by microfacets whose normal h is along v + eta w. No
// microfacet faces away from the surface, so there is no light where h.z < 0. At h.z = 0 the GGX distribution
// is alpha^2 / pi. So f jumps to 0 at the rim
//   g(v, w) = v.z + eta w.z = 0,
// a cone of directions about the shading normal (the local z). The lobe is where (1 - eta) g > 0. Thus the
// domain of
//   L = int f |w.z| L(w) dw
// moves with v, with the normal and with eta. In polar coordinates about z, |dg/dw.z| = eta, and (Reynolds'
// theorem; derivations, O)
//   dL = sign(1 - eta) int dphi f |w.z| L(w) dg/eta,
// where dg is taken along the w of the interior term's parametrisation: fixed direction or material form.
// Beckmann's distribution is 0 at h.z = 0: f does not jump, and such lobes have no rim.
#pragma once

#include "shading/bsdf/interface.h"

namespace edgegrad::EDGEGRAD_ISA {

// Returns whether the lobe has a rim. Seen steeply from the denser medium (v.z > eta) it has none.
EG_INLINE Mask has_rim(const Interface& g, Vec3 view) {
    return ~refracts_smoothly(g) & ~g.facets.beckmann & (largest_component(g.transmission) > 0.0f) &
           (view.z > 0.0f) & (view.z < g.eta);
}

struct RimSample {
    Mask active;
    Vec3 w;     // in the local frame
    Float pdf;  // per angle about the normal
};

// Samples a direction on the rim. f is proportional to (h.v) |h.w| / |v + eta w|^2. It peaks opposite to the
// view, the more narrowly the closer eta is to 1. The density of angles is proportional to 1 / |v + eta w|^2,
// whose integral is an arctangent.
EG_INLINE RimSample sample_rim(const Interface& g, Vec3 view, Float u) {
    const Float v2 = view.x * view.x + view.y * view.y, sine = sqrt(v2);
    // In the plane, v + eta w has the length |r e^(i psi) - sine|, with the angle psi from the direction
    // opposite to v.
    const Float r2 = max(g.eta * g.eta - view.z * view.z, 0.0f), r = sqrt(r2);
    const Float across = max(abs(g.eta * g.eta - 1.0f), 1e-12f), along = sine + r;
    const Float k = along * along / across;
    Float s, c;
    sincos_turn(0.5f * u, s, c);  // tan(psi / 2) = -c / (k s)
    const Float a = k * k * s * s, b = c * c, scale = 1.0f / max(a + b, 1e-30f);
    const Float cosine = (a - b) * scale, turn = -2.0f * k * s * c * scale;
    const Float near = across / max(along, 1e-20f);
    const Float sum2 = near * near + 4.0f * sine * r * b * scale;
    const Float inverse = 1.0f / max(sine, 1e-20f);
    const Mask tilted = sine > 1e-10f;
    const Float x = select(tilted, view.x * inverse, splat(1.0f)), y = select(tilted, view.y * inverse, 0.0f);
    const Float out = r / g.eta;
    RimSample sample;
    sample.active = has_rim(g, view);
    sample.w = {(-x * cosine - y * turn) * out, (-y * cosine + x * turn) * out, -view.z / g.eta};
    sample.pdf = across * 0.159154943f / max(sum2, 1e-30f);
    return sample;
}

// sign(1 - eta) f |w.z| g / eta for a direction on the rim. Only g has a derivative; the value is 0.
EG_INLINE Vec3 rim_change(const Interface& g, Vec3 view, Vec3 w) {
    const Vec3 f = select(g.facets.beckmann, zero3(), detach(evaluate_refraction<true>(g, view, w).value));
    const Float moved = view.z + g.eta * w.z, eta = detach(g.eta);
    return f * ((moved - detach(moved)) * select(eta > 1.0f, -1.0f / eta, 1.0f / eta));
}

// f |w.z| at the rim: the importance of a sample.
EG_INLINE Vec3 rim_value(const Interface& g, Vec3 view, Vec3 w) {
    return evaluate_refraction<true>(g, view, w).value;
}

}  // namespace edgegrad::EDGEGRAD_ISA
