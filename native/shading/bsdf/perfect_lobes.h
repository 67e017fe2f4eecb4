// Perfect and followed mirrors and interfaces as functions of the view. They repeat, for derivatives, what
// `sample` chose at random.
#pragma once

#include "shading/bsdf/bsdf.h"

namespace edgegrad::EDGEGRAD_ISA {

struct Specular {
    Vec3 wi;
    Vec3 value;  // f |cos| of the lobe; for followed lobes by the measure D(h) dh
};

// The cosine by which an interface refracts. Equal indices refract nothing, whichever way the normal points.
// Rough interfaces use the normal of a microfacet, which faces the view even where an interpolated normal
// does not.
EG_INLINE Float bending_cosine(const Interface& g, Float cosine) {
    return select(bends_nothing(g.eta), abs(cosine), cosine);
}

// Light of followed lobes, for the microfacet normal h in the lobe's frame.
EG_INLINE void scatter_followed(const Bsdf& f, Int lobe, Mask transmitted, Vec3 h, Vec3& w, Vec3& value) {
    const auto of = [&](Lobe k) { return lobe == splat(k); };
    const auto put = [&](const Microfacets& g, Mask m, Vec3 view, Vec3 way, Mask through, Float cosine,
                         Vec3 color) {
        value = select(m, color * (followed_light(g, view, way, through, cosine) * relative_density(g, h)),
                       value);
    };
    const auto mirror = [&](const Reflection& r, Mask m, Vec3 view, bool turns) {
        if (!any(m)) return;
        const Float cosine = dot(h, view);
        const Vec3 way = h * (2.0f * cosine) - view;
        put(r.facets, m, view, way, splat(0), cosine, reflectance(r, cosine));
        w = select(m, turns ? turned_back(f, way) : way, w);
    };
    if (f.any_lobe[kMirrorLobe])
        mirror(f.mirror, of(kMirrorLobe) & f.mirror.facets.followed, f.turned_view, true);
    if (f.any_lobe[kCoatLobe]) mirror(f.coat, of(kCoatLobe) & f.coat.facets.followed, f.view, false);
    if (!f.any_lobe[kInterfaceLobe]) return;
    const Mask glass =
        of(kInterfaceLobe) & f.glass.facets.followed & ~(transmitted & refracts_smoothly(f.glass));
    if (!any(glass)) return;
    const Float cosine = dot(h, f.view);
    const Split s = split_light(f.glass, cosine);
    const Vec3 through = h * (cosine / f.glass.eta - s.cosine) - f.view * (1.0f / f.glass.eta);
    const Vec3 way = select(transmitted, through, h * (2.0f * cosine) - f.view);
    put(f.glass.facets, glass, f.view, way, transmitted, cosine,
        select(transmitted, s.transmitted, s.reflected));
    w = select(glass, way, w);
}

// Light of lanes scattered by a perfect or followed `lobe`, to the other side where `transmitted`. `half` is
// the microfacet normal of followed lobes.
EG_INLINE Specular scatter_specular(const Bsdf& f, Int lobe, Mask transmitted, Mask followed, Vec3 half) {
    const Vec3 z = {splat(0.0f), splat(0.0f), splat(1.0f)};
    const Float cosine = f.view.z;
    const auto is = [&](Lobe k) { return lobe == splat(k); };
    Vec3 w = z * (2.0f * cosine) - f.view, value = zero3();
    if (f.any_lobe[kMirrorLobe]) value = select(is(kMirrorLobe), reflectance(f.mirror, cosine), value);
    if (f.any_lobe[kCoatLobe]) value = select(is(kCoatLobe), reflectance(f.coat, cosine), value);
    if (f.any_lobe[kInterfaceLobe]) {
        const Split s = split_light(f.glass, cosine);
        const Float bending = bending_cosine(f.glass, cosine);
        const Vec3 through = z * (bending / f.glass.eta - s.cosine) - f.view * (1.0f / f.glass.eta);
        w = select(is(kInterfaceLobe) & transmitted, through, w);
        value = select(is(kInterfaceLobe), select(transmitted, s.transmitted, s.reflected), value);
    }
    if (any(followed)) scatter_followed(f, lobe, transmitted, half, w, value);
    return {to_world(f, w), value};
}

// Closures that consist of one such lobe. They do not need the whole BSDF.
EG_INLINE Mask scatters_plainly(Int kind, Int flags) {
    return (is_kind(kind, kGlass) | is_kind(kind, kRefraction) | is_kind(kind, kGlossy)) &
           ~has_flag(flags, kMultiscatter | kAnisotropic | kThinFilm);
}

// The interface of smooth Glass and Refraction closures (add_glass, add_refraction).
EG_INLINE Interface plain_interface(Int kind, Vec3 color, Float ior, Mask from_inside) {
    Interface g = no_interface();
    const Float index = max(ior, 1e-5f);
    g.eta = select(from_inside, 1.0f / index, index);
    g.f0 = splat3(f0_of_ior(index));
    g.reflection = g.transmission = color;
    g.refracts_only = is_kind(kind, kRefraction);
    return g;
}

// `scatter_specular` of such closures. `mirror` is their normal (valid_mirror_normal).
EG_INLINE Specular scatter_plainly(const Interface& g, Vec3 mirror, Vec3 view, Int lobe, Mask transmitted) {
    const Mask interface = lobe == splat(kInterfaceLobe), through = interface & transmitted;
    const Float cosine = dot(mirror, view);
    const Split s = split_light(g, cosine);
    const Float along = select(through, bending_cosine(g, cosine) / g.eta - s.cosine, 2.0f * cosine),
                across = select(through, 1.0f / g.eta, splat(1.0f));
    return {mirror * along - view * across,
            select(interface, select(transmitted, s.transmitted, s.reflected), g.transmission)};
}

}  // namespace edgegrad::EDGEGRAD_ISA
