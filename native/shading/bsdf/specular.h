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

}  // namespace edgegrad::EDGEGRAD_ISA
