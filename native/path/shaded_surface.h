// A surface with any shader, as the path tracer scatters at it.
#pragma once

#include "shading/bsdf/bsdf.h"
#include "shading/receiving_normal.h"
#include "shading/surface_shader.h"
#include "shading/terminator_dimming.h"

namespace edgegrad::EDGEGRAD_ISA {

struct ShadedSurface {
    Vec3 normal;  // shading normal, on the viewer's side
    Bsdf bsdf;
    Mask transmits;
    const Vec3* smooth;  // the smooth normal, if a normal map may have bent it; else null
    // The terminator of bent normals is softened for all lobes of `diffuse` closures. In `layered` closures,
    // which have lobes of both kinds, it is softened for diffuse lobes and sheen alone, as in Cycles.
    Mask diffuse, layered;
    Vec3 receiving;   // receiving_normal() (shading/receiving_normal.h)
    bool from_below;  // it may differ from the geometric normal
    Float stretch;    // of the angle of arriving light (shading/terminator_dimming.h)
    bool dims;        // it may differ from 1

    static constexpr bool kSmooth = false;  // mirrors find light that no emitter sample can

    EG_INLINE Mask both_sides() const { return transmits; }
    EG_INLINE const Vec3* receiver() const { return from_below ? &receiving : nullptr; }
    EG_INLINE BsdfValue evaluate(Mask active, Vec3 w) const {
        BsdfValue f = EDGEGRAD_ISA::evaluate(bsdf, active, w, receiver());
        if (dims) f.value = f.value * terminator_dimming(stretch, dot(normal, w));
        if (!smooth) return f;
        f.value = f.value * bump_shadowing(*smooth, normal, w, diffuse);
        if (any(active & layered)) {
            const Vec3 soft = of_wide_lobes(active, w);
            f.value = select(layered, f.value + soft * softening(w), f.value);
        }
        return f;
    }
    // The factor of bent normals and of dimming for perfect lobes.
    EG_INLINE Float shown(Vec3 w) const {
        const Float bent = smooth ? bump_shadowing(*smooth, normal, w, diffuse) : splat(1.0f);
        return dims ? bent * terminator_dimming(stretch, dot(normal, w)) : bent;
    }
    // The diffuse lobes and sheen alone, without the factors of bent normals.
    EG_INLINE Vec3 of_wide_lobes(Mask active, Vec3 w) const {
        Bsdf wide = bsdf;
        wide.any_lobe[kMirrorLobe] = wide.any_lobe[kCoatLobe] = wide.any_lobe[kInterfaceLobe] = false;
        const Vec3 value = EDGEGRAD_ISA::evaluate(wide, active, w, receiver()).value;
        return dims ? value * terminator_dimming(stretch, dot(normal, w)) : value;
    }
    // What softening the terminator changes in the factor of bent normals.
    EG_INLINE Float softening(Vec3 w) const {
        return bump_shadowing(*smooth, normal, w, splat(-1)) - bump_shadowing(*smooth, normal, w, splat(0));
    }
    // The same for light that is visible only to rays of some kinds (bits 1 << RayKind): evaluates the lobes
    // that scatter those kinds.
    EG_INLINE BsdfValue evaluate_for(Int kinds, Mask active, Vec3 w) const {
        BsdfValue f = evaluate(active, w);
        Vec3 soft = of_wide_lobes(active, w);
        if (smooth) soft = soft * bump_shadowing(*smooth, normal, w, diffuse | layered);
        const auto seen = [&](RayKind kind) { return (kinds & (1 << kind)) != 0; };
        // Without a glossy lobe, the rest is rounding and may be negative. Its derivative stays.
        const auto raised = [](Float x) EG_INLINE_LAMBDA { return x + detach(max(-x, splat(0.0f))); };
        const Vec3 rest = f.value - soft, glossy = {raised(rest.x), raised(rest.y), raised(rest.z)};
        const Vec3 above =
            select(seen(kDiffuseRay), soft, zero3()) + select(seen(kGlossyRay), glossy, zero3());
        const Vec3 below = select(seen(kTransmissionRay), f.value, zero3());
        Mask upper = dot(bsdf.ng, w) > 0.0f;
        if (from_below) upper |= dot(receiving, w) > 0.0f;
        f.value = select(upper, above, below);
        return f;
    }
    // The factor of the rim of its transmission lobe (shading/bsdf/transmission_rim.h). Its value is 0.
    EG_INLINE Vec3 evaluate_rim(Mask active, Vec3 w) const {
        const Vec3 change = EDGEGRAD_ISA::evaluate_rim(bsdf, active, w);
        return smooth ? change * detach(bump_shadowing(*smooth, normal, w, diffuse)) : change;
    }
    EG_INLINE BsdfSample sample(Mask active, Float choice, Float u, Float v) const {
        BsdfSample s = EDGEGRAD_ISA::sample(bsdf, active, choice, u, v);
        if (smooth || dims) s.weight = s.weight * shown(s.wi);
        if (!smooth) return s;
        const Mask mixed = s.active & layered & ~s.specular;
        if (any(mixed)) {
            const Vec3 soft = of_wide_lobes(mixed, s.wi) * (softening(s.wi) / max(s.pdf, 1e-30f));
            s.weight = select(mixed, s.weight + soft, s.weight);
        }
        return s;
    }
};

EG_INLINE ShadedSurface shaded_surface(const SceneView& scene, Mask active, const SurfacePoint& x,
                                       const TexturePoint& point, const Shader& shader, Vec3 normal) {
    Vec3 tangent = zero3();
    if (scene.all_flags & kAnisotropic) {
        const Mask turned = active & has(shader, kAnisotropic);
        if (any(turned)) tangent = surface_tangent(scene, turned, shader.closure, point, normal);
    }
    const Mask transmits = has(shader, kHasRefraction) | (shader.kind == static_cast<int>(kTranslucent)) |
                           (shader.kind == static_cast<int>(kDisney));
    const bool bent = scene.all_flags & kHasNormalMap;
    const Mask diffuse =
        is_kind(shader.kind, kDiffuse) | is_kind(shader.kind, kTranslucent) | is_kind(shader.kind, kSheen);
    const Mask layered = is_kind(shader.kind, kPrincipled);
    return {normal,
            make_bsdf(active, shader.kind, shader.flags, material_values(shader.row), normal, x.normal,
                      tangent, x.side < 0.0f, point.view),
            transmits,
            bent ? &point.normal : nullptr,
            diffuse,
            layered,
            receiving_normal(scene, x, normal),
            scene.any_terminator,
            scene.any_dimming ? gather(scene.mesh_dimming, x.mesh) : splat(1.0f),
            scene.any_dimming};
}

// Light that a surface scatters from a sample of the lights. No ray finds lights without size, so for those
// lanes followed lobes are evaluated like other rough lobes.
template <typename Surface>
EG_INLINE BsdfValue scattered_light(const SceneView& scene, const Surface& surface, Int visible_to,
                                    Mask active, Mask pointlike, Vec3 w) {
    const auto value = [&](const Surface& s) EG_INLINE_LAMBDA {
        return scene.lights.any_hidden ? s.evaluate_for(visible_to, active, w) : s.evaluate(active, w);
    };
    if constexpr (requires { surface.bsdf; })
        if (scene.followed_alpha > 0.0f && any(active & pointlike)) {
            Surface whole = surface;
            follow_none(whole.bsdf, pointlike);
            return value(whole);
        }
    return value(surface);
}

}  // namespace edgegrad::EDGEGRAD_ISA
