// A recorded vertex as a function of the scene: the light that leaves it along the ray that found it,
//
//   L(x, wo) = L_e + sum over emitter samples  L f |n.w| dM/p  +  f |n.w'| L' dM'/p' .
//
// All random decisions are constants: densities, MIS weights, Russian roulette, visibility. The incoming
// light L' of the ray that continues is an input, whose derivative belongs to the next vertex. The positions
// move as follows (derivations, section 1; shared design, formulations 1 and 2):
// - Screen form: the first hit, and every hit after a specular vertex, is where its ray meets the moving
//   surface. So is a hit after a followed lobe, at a fixed microfacet normal (shading/bsdf/followed_lobes.h).
// - Material form: every other vertex and every emitter sample keeps its barycentrics. The measure |w.M|/r^2
//   that replaces the solid angle is differentiated with f.
// - Transparent surfaces are met where the segment between two scattering events intersects them.
// - Fixed direction: the emission of some meshes of many faces is differentiated at a fixed direction
//   (shading/lights/fixed_direction_light.h).
// - Near contact, material form and fixed direction are blended (scene/contact.h).
// - Directions to the environment rotate with its image.
// No rays are traced. The adjoint of a vertex' position is passed from its successor by path.
#pragma once

#include "adjoint/field_surface.h"
#include "adjoint/incident_light.h"
#include "adjoint/media_light.h"
#include "adjoint/specular_block.h"
#include "adjoint/thrown_sweep.h"
#include "path/shaded_surface.h"
#include "path/stream.h"
#include "shading/absorption.h"
#include "shading/bsdf/perfect_lobes.h"
#include "shading/lambertian.h"
#include "shading/phase_function.h"

namespace edgegrad::EDGEGRAD_ISA {

// The origin and direction of the ray that found a vertex, as numbers with derivatives.
struct Arrival {
    Vec3 from;       // its origin
    Vec3 direction;  // of any length; used in screen form only
};

struct Leaving {
    Vec3 light;      // leaves along the ray, backwards
    Vec3 position;   // of the vertex
    Vec3 direction;  // of the ray that continues, if it is specular
};

// Light scattered by a Lambertian surface whose normal is not bent by a normal map.
EG_INLINE Vec3 scattered_evenly(const SceneView& scene, const Lambertian& surface, Mask active,
                                const Scattering& s) {
    DiffuseLight lights[3];
    int count = 0;
    const auto add = [&](Mask m, Vec3 w, Vec3 value) {
        if (any(active & m)) lights[count++] = {active & m, w, value};
    };
    const Mask seen = scene.lights.any_hidden ? (s.light_visible_to & (1 << kDiffuseRay)) != 0 : splat(-1);
    add(s.light & seen, s.light_w, s.light_value);
    add(s.environment, s.environment_w, s.environment_value);
    add(s.next, s.next_w, s.next_value);
    return diffuse_reflection(surface.normal, surface.albedo, count, lights);
}

// Light scattered by any surface, except light of a fixed direction.
template <typename Surface>
EG_INLINE Vec3 scattered_moving(const SceneView& scene, const Surface& surface, Mask active,
                                const Scattering& s) {
    if constexpr (Surface::kSmooth)
        if (!surface.smooth) return scattered_evenly(scene, surface, active, s);
    Vec3 sum = zero3();
    const Mask light = active & s.light, environment = active & s.environment, next = active & s.next;
    if (any(light)) {
        Vec3 f = scattered_light(scene, surface, s.light_visible_to, light, s.followed, s.light_w).value;
        f = without_thrown(surface, light, s.throws, s.light_w, f, [&](const auto& rest, Mask m) {
            return scattered_light(scene, rest, s.light_visible_to, m, s.followed, s.light_w).value;
        });
        sum = select(light, f * s.light_value, sum);
    }
    const auto add = [&](Mask m, Int throws, Vec3 w, Vec3 value) {
        if (!any(m)) return;
        const auto evaluate = [&](const auto& lobes, Mask some) { return lobes.evaluate(some, w).value; };
        const Vec3 f = without_thrown(surface, m, throws, w, evaluate(surface, m), evaluate);
        sum = sum + select(m, f * value, zero3());
    };
    add(environment, s.throws_beyond, s.environment_w, s.environment_value);
    add(next, select(s.beyond, s.throws_beyond, splat(0)), s.next_w, s.next_value);
    return sum;
}

// Light scattered by any surface.
template <typename Surface>
EG_INLINE Vec3 scattered(const SceneView& scene, const Surface& surface, Mask active, const Scattering& s) {
    const Mask fixed = active & s.fixed;
    if (any(fixed)) {
        const Vec3 f = surface.evaluate(fixed, s.fixed_w).value;
        return select(fixed, f * s.fixed_value, zero3()) + scattered_moving(scene, surface, active, s);
    }
    return scattered_moving(scene, surface, active, s);
}

// A surface whose BSDF is replaced by the factor of a rim (path/rim.h). The recorder has already checked that
// lights are visible to its rays.
struct RimOfSurface {
    const ShadedSurface& surface;
    Mask of_gloss;

    static constexpr bool kSmooth = false;
    EG_INLINE BsdfValue evaluate(Mask active, Vec3 w) const {
        return {surface.evaluate_rim(active, w, of_gloss), splat(0.0f)};
    }
    EG_INLINE BsdfValue evaluate_for(Int, Mask active, Vec3 w) const { return evaluate(active, w); }
};

// Radiance of lights of the table along specular and camera rays.
EG_INLINE Vec3 lights_met(const SceneView& scene, const Vertex& v, Mask active, Vec3 from, Vec3 direction,
                          Mask in_medium, const MediumAround& medium) {
    Vec3 sum = zero3();
    const Vec3 w = unit_vector(direction);
    for_each_met_light(
        scene, active, from, load(v.from_mesh), w, load(v.near), load(v.far), load(v.kind),
        load(v.bounces_before_last), [&](int row, Mask seen, const LightRow& l, Float distance, Float) {
            Float factor = light_factor(l, w, distance);
            if (scene.light_followed)
                factor = factor * share_of_row(scene, row, {load(v.lobe_alpha), load(v.lobe_slope2)});
            Vec3 light = l.radiance * factor;
            if (any(in_medium))
                light = select(
                    in_medium,
                    light * kept_over(medium.extinction, max(detach(distance) - load(v.near), 0.0f)), light);
            sum = sum + select(seen, light, zero3());
        });
    return sum;
}

// Light that leaves media: scattered at points that move with the rays that found them, or passing. How the
// media's transmittance changes with distances is left out.
inline void leave_medium(const SceneView& scene, const VertexMemory& memory, const Vertex& v, Mask in_medium,
                         const MediumAround& medium, const Arrival& arrival, Vec3 direction, Vec3 incoming,
                         Int next, bool geometry, Leaving& out) {
    const Float way = load(v.medium_way);
    const Vec3 weight = load3(v.medium_weight) * change_over(medium.extinction, way - load(v.near));
    const Mask passes = in_medium & load(v.passes), scatters = in_medium & ~passes;
    Vec3 light = select(passes, incoming, zero3());
    if (any(scatters)) {
        const Vec3 along = unit_vector(direction);
        const Vec3 position = arrival.from + along * way;
        Scattering s =
            light_sources(scene, memory, v, scatters, position, splat(0), incoming, next, geometry);
        pass_on_shadow_rays(scene, memory, v, position, s, geometry);
        const PhaseFunction phase{-along, along, mean_cosine(medium.scattering, medium.forward)};
        light = select(scatters, scattered(scene, phase, scatters, s) * medium.scattering, light);
        out.position = select(scatters, position, out.position);
    }
    out.light = select(in_medium, out.light + light * weight, out.light);
}

// Light scattered by Lambertian vertices.
inline Vec3 scattered_by_lambertian(const SceneView& scene, const VertexMemory& memory, const Vertex& v,
                                    Mask active, const Lambertian& surface, const Scattering& s,
                                    Vec3 incoming, Int next, bool geometry) {
    Vec3 reflected = zero3();
    Mask still = splat(0);
    if (geometry && scene.has_environment && !scene.environment_image.pixels && !surface.smooth) {
        // Under a constant environment the unoccluded integral of the cosine does not depend on the normal.
        // Its derivative, zero in the mean, is subtracted from each sample as a control variate. Samples that
        // see the environment then cancel, and the derivative on convex bodies is exactly zero.
        const Vec3 environment = detach(splat3(scene.environment));
        const Float scale = load(v.next_scale);
        const Vec3 last_scale = load3(v.last_scale), wi = load3(v.next_direction);
        const Mask at_last =
            s.last & ~s.veiled & (last_scale.x == scale) & (last_scale.y == scale) & (last_scale.z == scale);
        const Mask missed_all = s.next & ~s.last & (incoming.x == environment.x) &
                                (incoming.y == environment.y) & (incoming.z == environment.z) &
                                ends_in_environment(memory, next);
        still = active & (at_last | missed_all);
        const Mask hidden = active & load(v.samples) & ~still;
        if (any(hidden)) {
            const Float cosine = dot(surface.normal, wi),
                        density = surface.pdf(max(detach(cosine), 0.0f) * kInvPi);
            const Vec3 lost = detach(surface.albedo) * environment;
            reflected = select(hidden, lost * ((detach(cosine) - cosine) * (kInvPi / density)), reflected);
        }
    }
    Scattering part = s;
    part.next &= ~still;
    reflected = reflected + scattered(scene, surface, active, part);
    if (any(still)) {
        part.next = still;
        part.light = part.environment = part.fixed = splat(0);
        const Lambertian fixed{detach(surface.normal), surface.ng, surface.albedo, nullptr, true};
        reflected = reflected + scattered(scene, fixed, active, part);
    }
    return reflected;
}

// Returns whether shading does not depend on the view: all surfaces are Lambertian without textures.
EG_INLINE bool diffuse_alone(const SceneView& scene) {
    return (scene.common_flags & kLambertian) && !(scene.all_flags & kHasNormalMap) &&
           !scene.textures.closure_program && !scene.textures.closure_weight_program;
}

// Vector along a ray through transparent surfaces: from its last scattering event to the next one, a point at
// fixed barycentrics, or towards the environment in direction w.
inline Vec3 way_through(const SceneView& scene, const VertexMemory& memory, Mask through, Int next, Vec3 from,
                        Vec3 w) {
    const Int face = next_ints(memory, through, next, &Vertex::face);
    const Mask surface = through & (face >= 0);
    Vec3 way = turned_with_environment(scene, w);
    if (!any(surface)) return way;
    const NextPoint y = next_point(scene, memory, surface, face, next);
    return select(surface, interpolate(y.triangle, y.b1, y.b2) - from, way);
}

// Computes the light that leaves a packet's vertices. `incoming` arrives along the ray that continues.
// `geometry`: positions and directions have derivatives.
inline Leaving leave_vertex(const SceneView& scene, const VertexMemory& memory, const Vertex& v,
                            const Arrival& arrival, Vec3 incoming, Int next, bool geometry) {
    const Mask active = load(v.active), hit = active & (load(v.face) >= 0);
    const Mask screen_form = active & load(v.screen_form);
    const Int rim = load(v.rim);
    const Mask on_rim = rim != splat(kNoRim);
    Leaving out{zero3(), zero3(), zero3()};
    const Vec3 recorded = load3(v.direction);
    const Vec3 direction = select(screen_form, arrival.direction, recorded);

    // Add environment light of rays that missed the scene
    const Float environment_weight = load(v.environment_weight);
    const Mask missed = active & (environment_weight > 0.0f);
    if (any(missed)) {
        // Sampled directions rotate with the environment, as seen from the previous vertex.
        const Vec3 towards = select(screen_form, arrival.direction, turned_with_environment(scene, recorded));
        out.light = select(missed, environment_radiance(scene, towards) * environment_weight, out.light);
    }
    // Add lights of the table along the ray, and light in media
    Mask in_medium = splat(0);
    MediumAround medium{};
    if (scene.any_medium) {
        in_medium = active & (load(v.face) == splat(kInMedium));
        if (any(in_medium)) medium = medium_around(scene, memory, v);
    }
    if (scene.lights.all_sized() > 0 && any(screen_form))
        out.light = out.light +
                    lights_met(scene, v, screen_form & ~on_rim, arrival.from, direction, in_medium, medium);
    if (any(in_medium))
        leave_medium(scene, memory, v, in_medium, medium, arrival, direction, incoming, next, geometry, out);
    if (!any(hit)) return out;

    // Compute the surface point and the view direction
    const Int face = select(hit, load(v.face), splat(0));
    const Int instance = select(hit, load(v.instance), splat(-1));
    PlacedTriangle t = placed_triangle(scene, face, instance);
    SurfacePoint x = surface_point(scene, hit, face, detach(t), load(v.b1), load(v.b2), recorded, instance);
    const Mask field = on_field(scene, hit, face);
    if (any(field)) t.triangle = select(field, x.triangle, t.triangle);
    x.mesh = load(v.mesh);
    Vec3 view = -recorded;
    // Let the point move in screen form, material form or a blend of both
    if (geometry) {
        const raw::Float blend = raw::load(v.fixed_weight);
        raw::Float screen_form_weight = all_of(screen_form) + blend;
        Vec3 way = direction;
        // Near contact the ray of the screen form must be the view direction up to rounding. Its part along
        // the ray is large and cancels in the view's derivative, but the sampled direction starts beside the
        // previous vertex.
        if (scene.mesh_contact)
            way = select(blend > 0.0f, constant3(values(x.position) - values(arrival.from)), way);
        if ((scene.all_flags & kHasTransparency) &&
            (scene.textures.closure_program || (scene.all_flags & kHasAbsorption))) {
            const Mask through = hit & load(v.passes) & ~screen_form & (next >= 0);
            if (any(through)) {
                way = select(through, way_through(scene, memory, through, next, arrival.from, recorded), way);
                screen_form_weight = raw::select(through, raw::splat(1.0f), screen_form_weight);
            }
        }
        if (any(field)) {
            FieldPoints on_fields;
            find_field_points(scene, field, face, values(x.position), on_fields);
            move_field_triangle(field, on_fields, t.triangle);
            move_met_point(x, t.triangle, screen_form_weight, arrival.from, way);
            turn_field_normals(on_fields, t.triangle, x);
        } else {
            move_met_point(x, t.triangle, screen_form_weight, arrival.from, way);
        }
        if (!diffuse_alone(scene)) view = unit(select(screen_form, -direction, arrival.from - x.position));
    }
    out.position = x.position;
    // Evaluate textures and the recorded closure
    const RayHistory history = ray_history(scene, load(v.bounces), x.position - arrival.from);
    const TexturePoint point = texture_point(scene, x, view, load(v.kind), history);
    const Int closure = select(hit, load(v.closure), splat(0));
    Shader shader = closure_shader(scene, x, closure, point);
    shader.scale = load(v.scale);
    if (scene.any_mixture) {
        // The closure was chosen in proportion to its weight, so only relative changes of the weight count.
        const Mask mixed = hit & (closure_count(scene, x.material) > 1);
        if (any(mixed))
            shader.scale = select(
                mixed, shader.scale * relative(closure_weight(scene, mixed, closure, point)), shader.scale);
    }

    // Add emission. On rims, where only the scattered light changes, the interior term has it.
    Vec3 light = zero3();
    const Mask passes = hit & load(v.passes), stays = hit & ~passes;
    const Float emission_weight = load(v.emission_weight);
    const Mask emits = stays & (emission_weight > 0.0f) & ~on_rim;
    if (any(emits)) light = select(emits, closure_emission(x, shader, point) * emission_weight, light);

    // Collect the incoming light and attenuate it by transparent surfaces
    Scattering s = light_sources(scene, memory, v, stays, x.position, x.material, incoming, next, geometry);
    pass_on_shadow_rays(scene, memory, v, x.position, s, geometry);
    const Vec3 normal = shading_normal(scene, stays, shader, point);
    // Scatter at Lambertian surfaces
    const Mask lambertian = stays & has(shader, kLambertian);
    Vec3 reflected = zero3();
    if (any(lambertian)) {
        const Vec3* smooth = scene.all_flags & kHasNormalMap ? &point.normal : nullptr;
        const Lambertian surface{normal, x.normal, shader.color(kBaseColor), smooth, true};
        reflected =
            scattered_by_lambertian(scene, memory, v, lambertian, surface, s, incoming, next, geometry);
    }
    // Scatter at all other surfaces
    const Mask others = stays & ~lambertian, perfect = others & s.specular;
    s.thrown &= others, s.thrown_beyond &= others;
    const bool scatters = any(others & (s.light | s.environment | s.next | s.thrown));
    const Int follows = select(others, load(v.follows), splat(0));
    const Mask followed = perfect & ((follows >> load(v.lobe) & 1) != 0);
    // Use a block of the tape for perfect lobes whose weights are constants
    if (!scatters && !any(followed) && any(perfect) && !(scene.all_flags & kHasNormalMap) &&
        !scene.any_dimming && plainly_specular(shader, perfect)) {
        const Specular mirrored =
            plain_specular(perfect, x, view, shader, normal, load(v.lobe), load(v.transmitted));
        reflected = select(perfect, mirrored.value * s.next_value, reflected);
        out.direction = mirrored.wi;
    } else if (scatters || any(perfect)) {
        ShadedSurface surface = shaded_surface(scene, others, x, point, shader, normal);
        const Mask at_rim = others & on_rim;
        if (any(at_rim))
            reflected =
                reflected + scattered(scene, RimOfSurface{surface, rim == splat(kGlossRim)}, at_rim, s);
        follow_lobes(surface.bsdf, follows);
        reflected = reflected + scattered(scene, surface, others & ~on_rim, s);
        if (any(s.thrown | s.thrown_beyond)) reflected = reflected + thrown_light(scene, v, surface, x, s);
        if (any(perfect)) {
            const Specular mirrored =
                scatter_specular(surface.bsdf, load(v.lobe), load(v.transmitted), followed, load3(v.half));
            Vec3 value = mirrored.value;
            if (surface.smooth || surface.dims) value = value * surface.shown(mirrored.wi);
            reflected = reflected + select(perfect, value * s.next_value, zero3());
            out.direction = mirrored.wi;
        }
    }
    light = light + reflected * shader.scale;

    // Combine the scattered and the transmitted light of transparent surfaces
    if (scene.all_flags & kHasTransparency) {
        // A path passes through with the probability of the transparent share. Where that is 0 or 1, it
        // passes with a probability of its own (chance_at_ends).
        Vec3 color;
        const Float share = passing_share(shader, color);
        const Mask partly = hit & has(shader, kHasTransparency);
        Float through = relative(share), rest = relative(1.0f - share);
        const Mask ends =
            partly & ((share <= 0.0f) | (share >= 1.0f)) & share_ends_change(memory.passed, closure);
        if (any(ends)) {
            const Float chance = chance_at_ends(detach(share));
            through = select(ends, share / chance, through);
            rest = select(ends, (1.0f - share) / (1.0f - chance), rest);
        }
        light = select(partly & stays, light * rest, light);
        light = select(passes, incoming * color * (shader.scale * through), light);
    }
    if (scene.all_flags & kHasAbsorption)
        light = light * kept_inside(scene, x, closure, length_of(x.position - arrival.from) - load(v.near));
    out.light = select(hit, light + out.light, out.light);
    return out;
}

}  // namespace edgegrad::EDGEGRAD_ISA
