// A surface with any shader, as the path tracer scatters at it.
#pragma once

#include "shading/bsdf/bsdf.h"
#include "shading/bsdf/filter_glossy.h"
#include "shading/receiving_normal.h"
#include "shading/surface_shader.h"
#include "shading/terminator_dimming.h"

namespace edgegrad::EDGEGRAD_ISA {

struct ShadedSurface {
    Vec3 normal;  // shading normal, on the viewer's side
    Bsdf bsdf;
    Mask transmits;
    const Vec3* smooth;  // the smooth normal, if a normal map may have bent it; else null
    // As in Cycles, bent normals shadow `diffuse` closures and the diffuse lobes and sheen of `layered` ones
    // (bump_shadowing). Other lobes have the normal `gloss`, whose reflections are valid
    // (valid_mirror_normal; velvet has the shading normal). From behind the smooth surface they scatter no
    // light of the light table. Translucent closures are shadowed for such light alone.
    Mask diffuse, layered, translucent;
    Vec3 gloss;
    Vec3 receiving;   // receiving_normal() (shading/receiving_normal.h)
    bool from_below;  // it may differ from the geometric normal
    Float stretch;    // of the angle of arriving light (shading/terminator_dimming.h)
    bool dims;        // it may differ from 1

    static constexpr bool kSmooth = false;  // mirrors find light that no emitter sample can

    EG_INLINE Mask both_sides() const { return transmits; }
    EG_INLINE const Vec3* receiver() const { return from_below ? &receiving : nullptr; }
    // `of_table`: lanes with light of the light table.
    // Compiled once, as the functions below: copies of all lobes in each caller would only compile slowly.
    EG_NOINLINE BsdfValue evaluate(Mask active, Vec3 w, Mask of_table = splat(0)) const {
        BsdfValue f = EDGEGRAD_ISA::evaluate(bsdf, active, w, receiver());
        const Float dimmed = dimming(gloss, w);
        if (dims) f.value = f.value * dimmed;
        if (!smooth) return f;
        const Float shadowing = bump_shadowing(*smooth, normal, w);
        const Mask shadowed = diffuse | (translucent & of_table), dark = of_table & lacks_gloss(w);
        f.value = select(dark & ~layered, zero3(), select(shadowed, f.value * shadowing, f.value));
        if (any(active & layered)) {
            const Vec3 wide = of_wide_lobes(active, w);
            const Float kept = shadowing * dimming(normal, w);
            f.value = select(layered, wide * kept + select(dark, zero3(), without(f.value, wide * dimmed)),
                             f.value);
        }
        return f;
    }
    // What is left of `all` without `part`. Rounding does not make it negative.
    EG_INLINE static Vec3 without(Vec3 all, Vec3 part) {
        const auto left = [](Float a, Float b) EG_INLINE_LAMBDA {
            const Float r = a - b;
            return r + detach(select((r < 0.0f) & (-r < 1e-5f * b), -r, 0.0f));
        };
        return {left(all.x, part.x), left(all.y, part.y), left(all.z, part.z)};
    }
    EG_INLINE Float dimming(Vec3 n, Vec3 w) const {
        return dims ? terminator_dimming(stretch, dot(n, w)) : splat(1.0f);
    }
    // Lanes without light of the light table in lobes that are not diffuse.
    EG_INLINE Mask lacks_gloss(Vec3 w) const { return ~(diffuse | translucent) & leaks(*smooth, gloss, w); }
    // Lanes that scatter light of the light table otherwise than other light. Emitter samples alone find it.
    EG_INLINE Mask by_emitters_alone(Vec3 w) const {
        return smooth ? lacks_gloss(w) | (translucent & ~is_same(*smooth, normal)) : splat(0);
    }
    // The factor of bent normals and of dimming for perfect lobes. Like rough ones, they reflect nothing
    // where their normal points away from the viewer.
    EG_INLINE Float shown(Vec3 w) const {
        const Float bent = smooth ? select(bsdf.view.z > 0.0f, splat(1.0f), 0.0f) : splat(1.0f);
        return dims ? bent * dimming(gloss, w) : bent;
    }
    // The diffuse lobes and sheen alone, without the factors of bent normals and of dimming.
    EG_NOINLINE Vec3 of_wide_lobes(Mask active, Vec3 w) const {
        Bsdf wide = bsdf;
        wide.any_lobe[kMirrorLobe] = wide.any_lobe[kCoatLobe] = wide.any_lobe[kInterfaceLobe] = false;
        return EDGEGRAD_ISA::evaluate(wide, active, w, receiver()).value;
    }
    // The same for light that is visible only to rays of some kinds (bits 1 << RayKind): evaluates the lobes
    // that scatter those kinds.
    EG_INLINE BsdfValue evaluate_for(Int kinds, Mask active, Vec3 w) const {
        const Mask of_table = (kinds & kOfTable) != 0;
        BsdfValue f = evaluate(active, w, of_table);
        Vec3 soft = of_wide_lobes(active, w);
        if (dims) soft = soft * dimming(normal, w);
        if (smooth) {
            const Mask shadowed = diffuse | layered | (translucent & of_table);
            soft = select(shadowed, soft * bump_shadowing(*smooth, normal, w), soft);
            soft = select(of_table & ~layered & lacks_gloss(w), zero3(), soft);
        }
        const auto seen = [&](RayKind kind) { return (kinds & (1 << kind)) != 0; };
        // Without a glossy lobe, the rest is rounding and may be negative. Its derivative stays.
        const auto raised = [](Float x) EG_INLINE_LAMBDA { return x + detach(max(-x, splat(0.0f))); };
        const Vec3 rest = f.value - soft, glossy = {raised(rest.x), raised(rest.y), raised(rest.z)};
        const Vec3 above =
            select(seen(kDiffuseRay), soft, zero3()) + select(seen(kGlossyRay), glossy, zero3());
        // Samples of lights count translucent lobes as diffuse, though their rays are those of transmission
        const Mask through = select(translucent, seen(kDiffuseRay), seen(kTransmissionRay));
        const Vec3 below = select(through, f.value, zero3());
        Mask upper = dot(bsdf.ng, w) > 0.0f;
        if (from_below) upper |= dot(receiving, w) > 0.0f;
        f.value = select(upper, above, below);
        return f;
    }
    // The factor of the rims of its lobes (evaluate_rim in shading/bsdf/bsdf.h). Its value is 0. `of_gloss`:
    // lanes on the rim of lit gloss.
    EG_INLINE Vec3 evaluate_rim(Mask active, Vec3 w, Mask of_gloss) const {
        const Mask lit = active & of_gloss;
        Vec3 change = EDGEGRAD_ISA::evaluate_rim(bsdf, active & ~lit, w) * detach(kept_at_rim(w));
        if (smooth && any(lit)) change = select(lit, gloss_rim_change(lit, w), change);
        return change;
    }
    // The rim of lit gloss. Where a normal map has bent the normal, gloss scatters no light of the light
    // table from behind the smooth surface (lacks_gloss). There it ends with a jump at the rim g(w) = s.w =
    // 0, a great circle about the smooth normal s (derivations, O), in lanes of:
    EG_INLINE Mask has_gloss_rim() const {
        if (!smooth) return splat(0);
        const bool* has = bsdf.any_lobe;
        const bool glossy = has[kMirrorLobe] || has[kCoatLobe] || has[kInterfaceLobe];
        const Mask without_gloss = glossy ? splat(0) : layered;
        return bsdf.active & ~(diffuse | translucent | without_gloss) & ~is_same(*smooth, gloss);
    }
    // The light that its gloss would scatter if the smooth surface hid none.
    EG_NOINLINE Vec3 unhidden_gloss(Mask active, Vec3 w) const {
        const Float dimmed = dimming(gloss, w);
        const Vec3 all = EDGEGRAD_ISA::evaluate(bsdf, active, w, receiver()).value * dimmed;
        const Mask over_diffuse = active & layered;
        if (!any(over_diffuse)) return all;
        return select(over_diffuse, without(all, of_wide_lobes(over_diffuse, w) * dimmed), all);
    }
    // The factor of that rim: f |n.w| g, with the sign of g on the lit side. Only g has a derivative.
    EG_INLINE Vec3 gloss_rim_change(Mask active, Vec3 w) const {
        const Float g = dot(*smooth, w), side = detach(dot(*smooth, gloss) * dot(gloss, w));
        return detach(unhidden_gloss(active, w)) *
               ((g - detach(g)) * select(side < 0.0f, splat(-1.0f), 1.0f));
    }
    // The part of the light that bent normals and dimming leave inside a rim.
    EG_INLINE Float kept_at_rim(Vec3 w) const {
        const Mask reflects = dot(bsdf.ng, w) > 0.0f;
        const Vec3 inside = w + normal * splat(1e-3f);
        Float kept = splat(1.0f);
        if (dims) kept = dimming(normal, inside);
        if (smooth) kept = kept * bump_shadowing(*smooth, normal, inside);
        return select(reflects, kept, splat(1.0f));
    }
    EG_INLINE BsdfSample sample(Mask active, Float choice, Float u, Float v) const {
        BsdfSample s = EDGEGRAD_ISA::sample(bsdf, active, choice, u, v);
        const Float dimmed = dimming(gloss, s.wi);
        if (dims) s.weight = s.weight * dimmed;
        if (!smooth) return s;
        const Mask perfect = s.active & s.specular, mixed = s.active & layered & ~s.specular;
        if (any(perfect)) s.weight = select(perfect & (bsdf.view.z <= 0.0f), zero3(), s.weight);
        const Float shadowing = bump_shadowing(*smooth, normal, s.wi);
        s.weight = select(diffuse, s.weight * shadowing, s.weight);
        if (any(mixed)) {
            const Vec3 wide = of_wide_lobes(mixed, s.wi) * (1.0f / max(s.pdf, 1e-30f));
            const Float kept = shadowing * dimming(normal, s.wi);
            s.weight = select(mixed, wide * kept + without(s.weight, wide * dimmed), s.weight);
        }
        return s;
    }
};

// Shaders that scatter light from behind.
EG_INLINE Mask transmits(const Shader& shader) {
    return has(shader, kHasRefraction) | is_kind(shader.kind, kTranslucent) | is_kind(shader.kind, kDisney);
}

// The result points into `point`, so that must not be a temporary.
ShadedSurface shaded_surface(const SceneView&, Mask, const SurfacePoint&, const TexturePoint&&, const Shader&,
                             Vec3) = delete;
inline EG_NOINLINE ShadedSurface shaded_surface(const SceneView& scene, Mask active, const SurfacePoint& x,
                                                const TexturePoint& point, const Shader& shader,
                                                Vec3 normal) {
    // The tangent is orthogonal to the smooth normal. Frames project it along theirs.
    Vec3 tangent = zero3();
    if (scene.all_flags & kAnisotropic) {
        const Mask turned = active & has(shader, kAnisotropic);
        if (any(turned)) tangent = surface_tangent(scene, turned, shader.closure, point, point.normal);
    }
    const bool bent = scene.all_flags & kHasNormalMap;
    if (bent) {
        const Mask turned = active & has(shader, kHasNormalMap) & is_kind(shader.kind, kTranslucent);
        if (any(turned)) normal = select(turned, valid_mirror_normal(normal, x.normal, point.view), normal);
    }
    // A copy of the large BSDF would cost time
    ShadedSurface s = {normal,
                       make_bsdf(active, shader.kind, shader.flags, material_values(shader.row), normal,
                                 x.normal, tangent, x.side < 0.0f, point.view),
                       transmits(shader),
                       bent ? &point.normal : nullptr,
                       is_kind(shader.kind, kDiffuse) | is_kind(shader.kind, kSheen),
                       is_kind(shader.kind, kPrincipled),
                       is_kind(shader.kind, kTranslucent),
                       normal,
                       receiving_normal(scene, x, point.normal),
                       scene.any_terminator,
                       scene.any_dimming ? gather(scene.mesh_dimming, x.mesh) : splat(1.0f),
                       scene.any_dimming};
    if (scene.least_alpha > 0.0f) {
        const Mask behind =
            active & has(shader, kHasGlossy | kHasRefraction) & is_behind_diffuse(point.history);
        if (any(behind)) filter_glossy(s.bsdf, behind, splat(scene.least_alpha));
    }
    if (bent) {
        const Mask glossy =
            active & has(shader, kHasGlossy | kHasRefraction) & ~is_kind(shader.kind, kVelvet);
        if (any(glossy)) s.gloss = select(glossy, s.bsdf.z, normal);
    }
    return s;
}

// Evaluates the lobes that scatter light which rays of `kinds` see (bits 1 << RayKind, and kOfTable). `all`:
// it is every kind of scattered rays.
template <typename Surface>
EG_INLINE BsdfValue evaluate_kinds(const Surface& surface, bool all, Int kinds, Mask active, Vec3 w) {
    if (!all) return surface.evaluate_for(kinds, active, w);
    if constexpr (requires { surface.gloss; })
        return surface.evaluate(active, w, (kinds & kOfTable) != 0);
    else
        return surface.evaluate(active, w);
}

// Light that a surface scatters from a sample of the lights, without what rays of followed lobes meet.
template <typename Surface>
EG_INLINE BsdfValue scattered_light(const SceneView& scene, const Surface& surface, Int visible_to,
                                    Mask active, const Followed& followed, Vec3 w) {
    const auto value = [&](const Surface& s) EG_INLINE_LAMBDA {
        return evaluate_kinds(s, !scene.lights.any_hidden, visible_to, active, w);
    };
    if constexpr (requires { surface.bsdf; })
        if (scene.followed_alpha > 0.0f &&
            any(active & ((followed.widest < scene.followed_alpha) | (followed.tail > 0.0f)))) {
            Surface whole = surface;
            follow_up_to(whole.bsdf, followed);
            return value(whole);
        }
    return value(surface);
}

}  // namespace edgegrad::EDGEGRAD_ISA
