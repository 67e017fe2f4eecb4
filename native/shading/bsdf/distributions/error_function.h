// The error function and its inverse. No derivatives: they serve densities and sampling only.
#pragma once

#include "simd/elementary.h"

namespace edgegrad::EDGEGRAD_ISA {

// Abramowitz and Stegun 1964, 7.1.26, for x >= 0.
EG_INLINE Float erf_positive(Float x) {
    const Float t = 1.0f / (1.0f + 0.3275911f * x);
    const Float p =
        ((((1.061405429f * t - 1.453152027f) * t + 1.421413741f) * t - 0.284496736f) * t + 0.254829592f) * t;
    return 1.0f - p * exp(-(x * x));
}

// Giles 2012, "Approximating the erfinv function", single precision. Arguments closer to +-1 than rounding
// are clamped, which keeps the result finite.
EG_INLINE Float inverse_erf(Float a) {
    const Float x = clamp(a, splat(-0.9999999f), splat(0.9999999f));
    const Float w = -log((1.0f - x) * (1.0f + x));
    const Float m = w - 2.5f;
    Float middle = splat(2.81022636e-08f);
    middle = middle * m + 3.43273939e-07f;
    middle = middle * m - 3.5233877e-06f;
    middle = middle * m - 4.39150654e-06f;
    middle = middle * m + 0.00021858087f;
    middle = middle * m - 0.00125372503f;
    middle = middle * m - 0.00417768164f;
    middle = middle * m + 0.246640727f;
    middle = middle * m + 1.50140941f;
    const Float s = sqrt(max(w, 5.0f)) - 3.0f;
    Float tail = splat(-0.000200214257f);
    tail = tail * s + 0.000100950558f;
    tail = tail * s + 0.00134934322f;
    tail = tail * s - 0.00367342844f;
    tail = tail * s + 0.00573950773f;
    tail = tail * s - 0.0076224613f;
    tail = tail * s + 0.00943887047f;
    tail = tail * s + 1.00167406f;
    tail = tail * s + 2.83297682f;
    return select(w < 5.0f, middle, tail) * x;
}

}  // namespace edgegrad::EDGEGRAD_ISA
