// The Beckmann distribution of microfacet normals (Walter et al. 2007) with height-correlated Smith masking
// (Heitz 2014). Visible normals are sampled after Heitz and d'Eon 2014 and Jakob 2014. Vectors are in the
// local frame, whose z is the shading normal.
#pragma once

#include "shading/bsdf/distributions/error_function.h"
#include "simd/vector.h"

namespace edgegrad::EDGEGRAD_ISA {

// Density of normals. The exponential is 0 long before z^2 is at its limit, for every alpha up to 1.
EG_INLINE Float beckmann_density(Float ax, Float ay, Vec3 h) {
    const Float x = h.x / max(ax, 1e-10f), y = h.y / max(ay, 1e-10f);
    const Float z2 = max(h.z * h.z, 1e-4f);
    return exp((x * x + y * y) * (-1.0f / z2)) / (3.14159265f * max(ax * ay, 1e-20f) * z2 * z2);
}

// Smith's lambda: the rational approximation of Walter et al., like Cycles. It is 0 from a = 1.6 on.
EG_INLINE Float beckmann_lambda(Float ax, Float ay, Vec3 w) {
    const Float x = ax * w.x, y = ay * w.y;
    const Float a = clamp(abs(w.z) / sqrt(max(x * x + y * y, 1e-20f)), splat(1e-9f), splat(1.6f));
    return max(((0.396f * a - 1.259f) * a + 1.0f) / ((2.181f * a + 3.535f) * a), 0.0f);
}

// Twice the area of the microfacets that the view sees, projected along the view, less its cosine z. Samples
// follow the exact area, not its approximation by beckmann_lambda.
EG_INLINE Float beckmann_stretched(Float ax, Float ay, Vec3 view) {
    const Float x = detach(ax * view.x), y = detach(ay * view.y), z = detach(max(view.z, 0.0f));
    const Float t = sqrt(max(x * x + y * y, 1e-20f)), a = min(z / t, splat(9.0f));
    return z * erf_positive(a) + t * exp(-(a * a)) * 0.564189584f;
}

// Samples a visible normal: first the slope along the view, in the frame where alpha is 1, then the one
// across.
//
// With b = erf(slope), the cumulative distribution of the slope along the view is
//   G(b) = c (1 + b) + s / sqrt(pi) exp(-slope^2)
// divided by its value at the last visible slope c / s. c and s are the cosine and sine of the stretched
// view. G rises and is concave there (dG/db = c - s slope), so that Newton's method converges from the left.
EG_OUTLINE Vec3 sample_beckmann(Float ax, Float ay, Vec3 view, Float u, Float v) {
    const Float x = ax * view.x, y = ay * view.y, z = max(view.z, 1e-6f);
    const Float length = sqrt(x * x + y * y + z * z), inverse = 1.0f / length;
    const Float across = sqrt(x * x + y * y), c = z * inverse, s = across * inverse;
    const Float k = 0.564189584f * s;
    const Float last = c / max(s, 1e-10f);
    const Float greatest = min(erf_positive(min(last, splat(9.0f))), splat(0.9999999f));
    const Float sought = u * (c * (1.0f + greatest) + k * exp(-min(last * last, splat(80.0f))));
    // Start where 1 - b^2 in place of exp(-slope^2) would give the value sought.
    const Float reach = c + 2.0f * k;
    Float b = 2.0f * (sought - c - k) / (c + sqrt(max(reach * reach - 4.0f * k * sought, 0.0f)));
    Float low = splat(-0.9999999f), high = greatest;
    b = clamp(b, low, high);
    Mask going = splat(-1);
    constexpr int kMostSteps = 12;
    for (int step = 0; step < kMostSteps; ++step) {
        const Float slope = inverse_erf(b);
        const Float off = c * (1.0f + b) + k * exp(-(slope * slope)) - sought;
        going &= abs(off) > 2e-7f;
        if (!any(going)) break;
        low = select(going & (off < 0.0f), b, low);
        high = select(going & (off > 0.0f), b, high);
        const Float rise = c - s * slope;
        const Float next = b - off / max(rise, 1e-10f);
        const Mask inside = (next > low) & (next < high);
        b = select(going, select(inside, next, 0.5f * (low + high)), b);
    }
    const Float along = inverse_erf(b), sideways = inverse_erf(2.0f * v - 1.0f);
    const Mask tilted = across > 1e-10f;
    const Float unit = 1.0f / max(across, 1e-10f);
    const Float cosine = select(tilted, x * unit, splat(1.0f)), sine = select(tilted, y * unit, 0.0f);
    const Vec3 h = {-ax * (cosine * along - sine * sideways), -ay * (sine * along + cosine * sideways),
                    splat(1.0f)};
    return h * (1.0f / sqrt(dot(h, h)));
}

}  // namespace edgegrad::EDGEGRAD_ISA
