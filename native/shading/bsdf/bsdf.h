// The BSDFs of all closures (scene/material_params.h). A BSDF is prepared once for a view, then evaluated and
// sampled:
//
//   const Bsdf f = make_bsdf(active, kind, flags, material_values(row), n, ng, tangent, from_inside, wo);
//   const BsdfValue e = evaluate(f, active, wi);
//   const BsdfSample s = sample(f, active, choice, u, v);
//
// `evaluate` returns the sum of all lobes except perfect and followed ones, and the density of `sample`.
// `sample` chooses a lobe in proportion to its estimated albedo. Light is lost that a mirror would reflect
// below the triangle, or that an interface would refract above it.
#pragma once

#include "scene/view.h"
#include "shading/bsdf/diffuse_rim.h"
#include "shading/bsdf/followed_lobes.h"
#include "shading/bsdf/principled.h"

namespace edgegrad::EDGEGRAD_ISA {

EG_INLINE Mask is_kind(Int kind, ShaderKind k) { return kind == splat(k); }

// The local frame of mirrors. In `anisotropic` lanes the mirror's own x axis is along the tangent, rotated
// about z by `turns`, or about the shading normal in lanes of `layered`, as in Cycles. The frame itself does
// not follow the tangent: lobes that are nearly round would have derivatives by its rotation that cancel
// almost completely.
EG_INLINE void make_frame(Bsdf& f, Mask anisotropic, Mask layered, Vec3 tangent, Float turns) {
    f.z = valid_mirror_normal(f.normal, f.ng, f.wo);
    basis(f.z, f.x, f.y);
    if (any(anisotropic)) {
        Float s, c;
        sincos_turn(fract(turns), s, c);
        const Vec3 n = f.normal;
        const Mask before = anisotropic & layered & ((f.z.x != n.x) | (f.z.y != n.y) | (f.z.z != n.z));
        if (any(before)) {
            const Vec3 rotated = tangent * c + cross(n, tangent) * s + n * (dot(n, tangent) * (1.0f - c));
            tangent = select(before, rotated, tangent);
            s = select(before, splat(0.0f), s), c = select(before, splat(1.0f), c);
        }
        const Float x = dot(f.x, tangent), y = dot(f.y, tangent), length = sqrt(x * x + y * y);
        const Float unit = 1.0f / max(length, 1e-20f), cosine = x * unit, sine = y * unit;
        const Mask known = anisotropic & (length > 1e-10f);
        f.turn_cosine = select(known, cosine * c - sine * s, splat(1.0f));
        f.turn_sine = select(known, sine * c + cosine * s, splat(0.0f));
        f.any_turned = true;
    }
    f.view = to_local(f, f.wo);
    f.turned_view = turned(f, f.view);
}

// Normalizes the lobes' albedos to probabilities.
EG_INLINE void normalize_probabilities(Bsdf& f) {
    Float sum = splat(0.0f);
    for (int k = 0; k < kLobes; ++k)
        if (f.any_lobe[k]) sum = sum + f.probability[k];
    const Float scale = select(sum > 0.0f, 1.0f / max(sum, 1e-30f), 0.0f);
    for (int k = 0; k < kLobes; ++k)
        if (f.any_lobe[k]) f.probability[k] = f.probability[k] * scale;
}

// Prepares the BSDF of active lanes. The unit normals are on the viewer's side; `from_inside`: that is the
// back of the triangle. `tangent` is any vector along the surface, for anisotropy. wo is the unit vector
// towards the viewer.
EG_INLINE Bsdf make_bsdf(Mask active, Int kind, Int flags, const MaterialValues& v, Vec3 n, Vec3 ng,
                         Vec3 tangent, Mask from_inside, Vec3 wo) {
    Bsdf f = no_bsdf(active, n, ng, wo);
    f.emission = select(active, v.emission, zero3());
    if (any(active & has_flag(flags, kHasGlossy | kHasRefraction))) {
        const Mask anisotropic = active & has_flag(flags, kAnisotropic);
        const Mask principled = active & is_kind(kind, kPrincipled);
        make_frame(f, anisotropic, principled, tangent, v.anisotropy_rotation);
        f.mirror = no_reflection();
        f.mirror.facets = make_facets(splat(1.0f), splat(1.0f), f.view);
        f.glass = no_interface();
        f.glass.facets = f.mirror.facets;
        if (any(principled)) add_principled(f, principled, v, flags, from_inside);
        const Mask glossy = active & is_kind(kind, kGlossy);
        if (any(glossy)) add_glossy(f, glossy, v, flags);
        const Mask glass = active & is_kind(kind, kGlass);
        if (any(glass)) add_glass(f, glass, v, flags, from_inside);
        const Mask refraction = active & is_kind(kind, kRefraction);
        if (any(refraction)) add_refraction(f, refraction, v, flags, from_inside);
        const Mask sheen = active & is_kind(kind, kSheen);
        if (any(sheen)) add_sheen(f, sheen, v);
        const Mask velvet = active & is_kind(kind, kVelvet);
        if (any(velvet)) add_velvet(f, velvet, v);
        const Mask disney = active & is_kind(kind, kDisney);
        if (any(disney)) add_disney(f, disney, v);
    } else {
        const Mask principled = active & is_kind(kind, kPrincipled);
        if (any(principled)) add_diffuse(f, principled, v, v.base_color);
    }
    const Mask diffuse = active & is_kind(kind, kDiffuse);
    if (any(diffuse)) add_diffuse(f, diffuse, v, v.base_color);
    const Mask translucent = active & is_kind(kind, kTranslucent);
    if (any(translucent)) add_translucent(f, translucent, v);
    normalize_probabilities(f);
    return f;
}

// Emission of the surface, attenuated by the layers above it.
EG_INLINE Vec3 emitted(const Bsdf& f) { return f.emission; }

// f |cos| of the diffuse lobe divided by its cosine density.
EG_INLINE Vec3 diffuse_factor(const Bsdf& f, Vec3 wi, Float cosine) {
    Vec3 value = f.diffuse;
    if (f.any_oren_nayar) value = value * oren_nayar(f.oren_nayar, f.cosine, cosine, dot(f.wo, wi));
    if (f.any_burley) {
        const Vec3 sum = f.wo + wi;
        const Float half = dot(sum, wi) / max(sqrt(dot(sum, sum)), 1e-20f);
        value = select(f.burley >= 0.0f, value * burley(f.burley, f.cosine, cosine, half), value);
    }
    return value;
}

EG_INLINE void add(BsdfValue& sum, Mask m, const Scattered& s, Float probability) {
    sum.value = sum.value + select(m, s.value, zero3());
    sum.pdf = sum.pdf + select(m, s.pdf * probability, splat(0.0f));
}

EG_OUTLINE void replace_by_velvet(const Bsdf& f, Vec3 wi, Scattered& s) {
    const Mask m = f.sheen.velvet;
    const Float value = velvet_value(f.sheen.sigma, f.normal, f.wo, f.cosine, wi);
    s.value = select(m, f.sheen.weight * value, s.value);
    s.pdf = select(m, select(dot(f.normal, wi) > 0.0f, splat(kUniformDensity), 0.0f), s.pdf);
}

// Light above the plane of ng is reflected and light below it refracted. `receiving`, if not null, is a
// second normal above whose plane light is reflected (shading/receiving_normal.h).
EG_INLINE BsdfValue evaluate(const Bsdf& f, Mask active, Vec3 wi, const Vec3* receiving = nullptr,
                             const Vec3* local = nullptr) {
    BsdfValue sum = {zero3(), splat(0.0f)};
    // Add the lobes that are defined by the shading normal
    const Float cosine = dot(f.normal, wi);
    const auto side = detach(receiving ? max(dot(f.ng, wi), dot(*receiving, wi)) : dot(f.ng, wi));
    const Mask above = active & (side > 0.0f), under = active & (side < 0.0f);
    if (f.any_lobe[kDiffuseLobe]) {
        const Float density = max(cosine, 0.0f) * kInvPi;
        add(sum, above, {diffuse_factor(f, wi, max(cosine, 0.0f)) * density, detach(density)},
            f.probability[kDiffuseLobe]);
    }
    if (f.any_lobe[kTranslucentLobe]) {
        const Float density = max(-cosine, 0.0f) * kInvPi;
        add(sum, under, {f.translucent * density, detach(density)}, f.probability[kTranslucentLobe]);
    }
    if (f.any_lobe[kSheenLobe]) {
        const Float density = sheen_density(f.sheen, f.normal, wi);
        Scattered s = {f.sheen.weight * density, detach(density)};
        if (f.sheen.any_velvet) replace_by_velvet(f, wi, s);
        add(sum, above, s, f.probability[kSheenLobe]);
    }
    if (!(f.any_lobe[kMirrorLobe] | f.any_lobe[kCoatLobe] | f.any_lobe[kInterfaceLobe])) return sum;
    // Add the reflection of mirrors and interfaces
    const Vec3 w = local ? *local : to_local(f, wi);
    if (any(above)) {
        const Vec3 between = f.view + w;
        const Vec3 h = between * (1.0f / max(sqrt(dot(between, between)), 1e-20f));
        const Float half = dot(h, f.view);
        if (f.any_lobe[kMirrorLobe])
            add(sum, above, evaluate_reflection(f.mirror, f.turned_view, turned(f, w), turned(f, h), half),
                f.probability[kMirrorLobe]);
        if (f.any_lobe[kCoatLobe])
            add(sum, above, evaluate_reflection(f.coat, f.view, w, h, half), f.probability[kCoatLobe]);
        if (f.any_lobe[kInterfaceLobe])
            add(sum, above, evaluate_interface_reflection(f.glass, f.view, w, h, half),
                f.probability[kInterfaceLobe]);
    }
    // Add the refraction of interfaces
    if (f.any_lobe[kInterfaceLobe] && any(under))
        add(sum, under, evaluate_refraction(f.glass, f.view, w), f.probability[kInterfaceLobe]);
    return sum;
}

// The factor of the rims of the diffuse lobe, above the plane of ng, and of the transmission lobe, below it
// (shading/bsdf/diffuse_rim.h, shading/bsdf/transmission_rim.h). Its value is 0.
EG_INLINE Vec3 evaluate_rim(const Bsdf& f, Mask active, Vec3 wi) {
    const Float side = detach(dot(f.ng, wi));
    const Mask above = active & (side > 0.0f) & has_diffuse_rim(f), under = active & (side < 0.0f);
    Vec3 change = zero3();
    if (any(above)) change = select(above, diffuse_rim_change(f, wi), change);
    if (f.any_lobe[kInterfaceLobe] && any(under))
        change = select(under, rim_change(f.glass, f.view, to_local(f, wi)), change);
    return change;
}

// Directions sampled from one kind of lobe, for the lanes that chose it.
struct Direction {
    Vec3 wi;
    Vec3 local;  // wi in the frame of the lobes, for lanes of `in_frame`
    Mask in_frame;
    Mask perfect, transmitted;
    Vec3 half;   // of the microfacet, for followed lobes
    Vec3 value;  // for perfect lobes: f |cos| / probability, without the lobe's probability
    Float probability;
    Int ray_kind;
    Int lobe;
};

// Completes the samples of followed lobes. `h` is the microfacet normal in the lobe's frame, `value` its
// reflectance or transmittance divided by the probability of that choice.
EG_INLINE void follow_sample(const Microfacets& g, Mask m, Vec3 view, Float bound, Vec3 w, Vec3 h,
                             Float cosine, Vec3 value, Direction& d) {
    if (!any(m)) return;
    const Float density = followed_density(g, view, bound, cosine);
    d.value = select(m, value * (followed_light(g, view, w, d.transmitted, cosine) / max(density, 1e-20f)),
                     d.value);
    d.probability = select(m, d.probability * density, d.probability);
    d.half = select(m, h, d.half);
}

EG_INLINE void set_direction(const Bsdf& f, Mask m, Vec3 local, Direction& d) {
    d.local = select(m, local, d.local);
    d.in_frame |= m;
    d.wi = select(m, to_world(f, local), d.wi);
}

// Samples a mirror or the coat. The coat's frame is not rotated.
EG_INLINE void sample_mirror(const Bsdf& f, const Reflection& r, bool coat, Mask picked, Float u, Float v,
                             Direction& d) {
    const Vec3 view = coat ? f.view : f.turned_view;
    const Vec3 h = sample_reflection(r, view, u, v);
    const Float cosine = dot(h, view);
    const Mask smooth = picked & is_smooth(r.facets);
    const Vec3 w = h * (2.0f * cosine) - view;
    set_direction(f, picked, coat ? w : turned_back(f, w), d);
    d.perfect |= picked & is_perfect(r.facets);
    d.half = select(picked, h, d.half);
    if (any(smooth)) d.value = select(smooth, reflectance(r, cosine), d.value);
    const Mask followed = picked & r.facets.followed;
    if (any(followed))
        follow_sample(r.facets, followed, view, r.facets.bound, w, h, cosine, reflectance(r, cosine), d);
    d.ray_kind = select(picked, splat(kGlossyRay), d.ray_kind);
}

// Samples a direction. The random number u_all chooses the lobe and is then rescaled, so that samples that
// are well distributed over (u, v) are so within each lobe. `choice` decides between reflection and
// refraction.
EG_INLINE BsdfSample sample(const Bsdf& f, Mask active, Float choice, Float u_all, Float v) {
    // Initialize the sample
    Direction d;
    d.wi = d.local = f.normal;
    d.perfect = d.transmitted = d.in_frame = splat(0);
    d.half = f.normal;
    d.value = zero3();
    d.probability = splat(1.0f);
    d.ray_kind = splat(kDiffuseRay);
    d.lobe = splat(0);
    // Choose a lobe
    Mask left = active;
    Float share = splat(1.0f);  // probability of the lobe
    Float passed = splat(0.0f);
    Mask done = splat(0);
    for (int k = 0; k < kLobes; ++k) {
        if (!f.any_lobe[k]) continue;
        const Float p = f.probability[k];
        const Mask picked = left & (p > 0.0f) & (u_all < passed + p);
        const Float u = clamp((u_all - passed) / max(p, 1e-20f), splat(0.0f), splat(0.99999994f));
        passed = passed + p;
        if (!any(picked)) continue;
        left &= ~picked;
        done |= picked;
        share = select(picked, p, share);
        d.lobe = select(picked, splat(k), d.lobe);
        // Sample the lobe's direction
        switch (k) {
            case kDiffuseLobe:
                d.wi = select(picked, cosine_direction(f.normal, u, v), d.wi);
                break;
            case kTranslucentLobe:
                d.wi = select(picked, -cosine_direction(f.normal, u, v), d.wi);
                d.transmitted |= picked;
                break;
            case kMirrorLobe:
                sample_mirror(f, f.mirror, false, picked, u, v, d);
                break;
            case kCoatLobe:
                sample_mirror(f, f.coat, true, picked, u, v, d);
                break;
            case kSheenLobe:
                d.wi = select(picked, sample_sheen(f.sheen, f.normal, u, v), d.wi);
                if (f.sheen.any_velvet)
                    d.wi = select(picked & f.sheen.velvet, uniform_direction(f.normal, u, v), d.wi);
                break;
            case kInterfaceLobe: {
                const InterfaceSample s = sample_interface(f.glass, f.view, choice, u, v);
                set_direction(f, picked, s.w, d);
                d.perfect |= picked & s.perfect;
                d.transmitted |= picked & s.refracted;
                done &= ~picked | s.found;
                d.value = select(picked & s.perfect, s.value, d.value);
                d.probability = select(picked, s.probability, d.probability);
                const Mask followed =
                    picked & f.glass.facets.followed & ~(s.refracted & refracts_smoothly(f.glass));
                follow_sample(f.glass.facets, followed, f.view, splat(1.0f), s.w, s.h, dot(s.h, f.view),
                              s.value, d);
                d.ray_kind = select(picked, splat(kGlossyRay), d.ray_kind);
                break;
            }
            default:
                break;
        }
    }
    // Drop directions on the wrong side, and evaluate all lobes in the others
    const Float side = dot(f.ng, d.wi);
    BsdfSample s;
    s.wi = d.wi;
    s.transmitted = d.transmitted;
    s.specular = d.perfect;
    s.half = d.half;
    s.lobe = d.lobe;
    s.ray_kind = select(d.transmitted, splat(kTransmissionRay), d.ray_kind);
    s.active = done & select(d.transmitted, side < 0.0f, side > 0.0f);
    // The density is that of the direction before its way to the world and back. This way's rounding error e
    // is the same for all samples of a lobe. In the density it would shift the samples against the lobe, and
    // their scores, which are about 1/alpha, would no longer cancel: a bias of derivatives of about e /
    // alpha^2.
    const Mask rough = s.active & ~d.perfect;
    const Vec3 local = any(rough & ~d.in_frame) ? select(d.in_frame, d.local, to_local(f, d.wi)) : d.local;
    const BsdfValue e = evaluate(f, rough, d.wi, nullptr, &local);
    s.active &= d.perfect | (e.pdf > 0.0f);
    s.weight =
        select(d.perfect, d.value * (1.0f / max(share, 1e-20f)), e.value * (1.0f / max(e.pdf, 1e-30f)));
    s.weight = select(s.active, s.weight, zero3());
    s.pdf = select(s.active, select(d.perfect, share * d.probability, e.pdf), splat(0.0f));
    return s;
}

}  // namespace edgegrad::EDGEGRAD_ISA
