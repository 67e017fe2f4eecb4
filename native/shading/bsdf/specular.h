// Perfect mirrors and interfaces as functions of the view: what `sample` found by chance, once more.
#pragma once

#include "shading/bsdf/bsdf.h"

namespace edgegrad::EDGEGRAD_ISA {

struct Specular {
    Vec3 wi;
    Vec3 value;  // f |cos| of the lobe
};

// Of the lanes that a perfect `lobe` scatters, to the other side where `transmitted`.
EG_INLINE Specular scatter_specular(const Bsdf& f, Int lobe, Mask transmitted) {
    const Vec3 z = {splat(0.0f), splat(0.0f), splat(1.0f)};
    const Float cosine = f.view.z;
    const auto is = [&](Lobe k) { return lobe == splat(static_cast<int>(k)); };
    Vec3 w = z * (2.0f * cosine) - f.view, value = zero3();
    if (f.any_lobe[kMirrorLobe]) value = select(is(kMirrorLobe), reflectance(f.mirror, cosine), value);
    if (f.any_lobe[kCoatLobe]) value = select(is(kCoatLobe), reflectance(f.coat, cosine), value);
    if (f.any_lobe[kInterfaceLobe]) {
        const Split s = split_light(f.glass, cosine);
        const Vec3 through = z * (cosine / f.glass.eta - s.cosine) - f.view * (1.0f / f.glass.eta);
        w = select(is(kInterfaceLobe) & transmitted, through, w);
        value = select(is(kInterfaceLobe), select(transmitted, s.transmitted, s.reflected), value);
    }
    return {to_world(f, w), value};
}

// Shaders that have one such lobe alone: for these the whole BSDF, most of which is not of use, need not be
// prepared.
EG_INLINE Mask scatters_plainly(Int kind, Int flags) {
    return (is_kind(kind, kGlass) | is_kind(kind, kRefraction) | is_kind(kind, kGlossy)) &
           ~has_flag(flags, kMultiscatter | kAnisotropic);
}

// The interface of Glass and Refraction (add_glass, add_refraction) where it is smooth.
EG_INLINE Interface plain_interface(Int kind, Vec3 color, Float ior, Mask from_inside) {
    Interface g = no_interface();
    const Float index = max(ior, 1e-5f);
    g.eta = select(from_inside, 1.0f / index, index);
    g.f0 = splat3(f0_of_ior(index));
    g.reflection = g.transmission = color;
    g.refracts_only = is_kind(kind, kRefraction);
    return g;
}

// What `scatter_specular` gives of them; `mirror` is their normal (valid_mirror_normal).
EG_INLINE Specular scatter_plainly(const Interface& g, Vec3 mirror, Vec3 view, Int lobe, Mask transmitted) {
    const Mask interface = lobe == splat(static_cast<int>(kInterfaceLobe)), through = interface & transmitted;
    const Float cosine = dot(mirror, view);
    const Split s = split_light(g, cosine);
    const Float along = select(through, cosine / g.eta - s.cosine, 2.0f * cosine),
                across = select(through, 1.0f / g.eta, splat(1.0f));
    return {mirror * along - view * across,
            select(interface, select(transmitted, s.transmitted, s.reflected), g.transmission)};
}

}  // namespace edgegrad::EDGEGRAD_ISA
