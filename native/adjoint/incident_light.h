// The light that arrives at a recorded vertex as a function of the scene: of its emitter samples, and along
// the ray that continues. adjoint/vertex.h explains what moves.
#pragma once

#include "adjoint/field_surface.h"
#include "adjoint/light_arrival.h"
#include "adjoint/transparent_light.h"
#include "shading/lights/environment.h"
#include "shading/lights/fixed_direction_light.h"
#include "tasks/records/vertex_record.h"

namespace edgegrad::EDGEGRAD_ISA {

using Vertex = VertexPacket<W>;

EG_INLINE Vec3 load3(const float (&field)[3][W]) { return {load(field[0]), load(field[1]), load(field[2])}; }

// A field of the vertices that the continuing rays have found.
EG_INLINE Int next_ints(const VertexMemory& memory, Mask active, Int next,
                        const Vertex::Ints Vertex::* field) {
    return raw::gather(memory.at<W>(0).*field, select(active, next, splat(0)));
}
EG_INLINE raw::Float next_floats(const VertexMemory& memory, Mask active, Int next,
                                 const Vertex::Floats Vertex::* field) {
    return raw::gather(memory.at<W>(0).*field, select(active, next, splat(0)));
}

EG_INLINE RawVec3 next_drift(const VertexMemory& memory, Mask active, Int next) {
    const auto& drift = memory.at<W>(0).drift;
    const Int at = select(active, next, splat(0));
    const auto part = [&](int c) { return raw::select(active, raw::gather(drift[c], at), 0.0f); };
    return {part(0), part(1), part(2)};
}

// Returns where the continuing rays have met nothing.
EG_INLINE Mask ends_in_environment(const VertexMemory& memory, Int next) {
    const Mask some = next >= 0;
    return some & (next_ints(memory, some, next, &Vertex::face) == splat(-1));
}

// The constant direction w, which rotates with the environment's image.
EG_INLINE Vec3 turned_with_environment(const SceneView& scene, Vec3 w) {
    Vec3 in_image = rotated(scene.environment_rotation, w);
    return rotated_back(scene.environment_rotation, detach(in_image));
}

// Directions from which a vertex receives light, and the light of each, without the factor f |cos|.
struct Scattering {
    Mask light, environment, next;
    Mask last;    // of `next`: rays that could only meet the environment
    Mask veiled;  // of `last`: rays through transparent surfaces
    // Not in `next`: the ray continues from a perfect or followed lobe, with the light next_value.
    Mask specular;
    Followed followed;  // of `light`: what is followed for it
    // Bits of the lobes that throw a part of the light (path/lights/thrown_light.h): of `light`, and of
    // `environment` and of `next` where it ends in the environment.
    Int throws, throws_beyond;
    Mask beyond;         // of `next`: the ray ends in the environment
    Mask thrown;         // not in `light`: the emitter sample is thrown light
    Mask thrown_beyond;  // besides `next`: the sampled lobe throws light of the environment
    Mask fixed;          // the continuing ray also brings light of a fixed direction
    Int light_visible_to;
    Vec3 light_w, environment_w, next_w, fixed_w;
    Vec3 light_value, environment_value, next_value, fixed_value;
    Vec3 kept;  // the change of what media keep of the emitter sample: 1, with a derivative
};

// The point of a surface that is the next vertex, with its motion.
struct NextPoint {
    Triangle triangle;
    Int instance;
    Float b1, b2;
};

EG_INLINE NextPoint next_point(const SceneView& scene, const VertexMemory& memory, Mask surface, Int face,
                               Int next) {
    NextPoint y{gather_triangle(scene, select(surface, face, splat(0))),
                next_ints(memory, surface, next, &Vertex::instance),
                constant(next_floats(memory, surface, next, &Vertex::b1)),
                constant(next_floats(memory, surface, next, &Vertex::b2))};
    place_triangle(scene, select(surface, y.instance, splat(-1)), y.triangle);
    settle_on_fields(scene, surface, face, y.triangle, y.b1, y.b2);
    move_settled_triangle(scene, surface, face, y.triangle);
    return y;
}

// Emission found by the continuing rays, on surfaces of one constant emission.
EG_INLINE Vec3 emission_of_next(const SceneView& scene, const VertexMemory& memory, Mask active, Int next) {
    const Int closure = select(active, next_ints(memory, active, next, &Vertex::closure), splat(0));
    const raw::Float weight = next_floats(memory, active, next, &Vertex::emission_weight);
    RawVec3 emission;
    const auto channel = [&](int c) {
        return raw::gather(scene.closure_params + kEmission + c,
                           closure * static_cast<int32_t>(kMaterialParams)) *
               weight;
    };
    emission.x = channel(0), emission.y = channel(1), emission.z = channel(2);
    return constant3(emission);
}

// Motion of the points on emissive faces that emitter samples have found.
EG_INLINE FarMotion light_motion(const SceneView& scene, const Vertex& v, Mask material_form) {
    FarMotion motion = far_motion(material_form);
    if (!scene.mesh_contact) return motion;
    motion.material_form = motion.material_form - raw::load(v.light_fixed_weight);
    motion.drift = {raw::load(v.light_drift[0]), raw::load(v.light_drift[1]), raw::load(v.light_drift[2])};
    return motion;
}

// Collects the light that a vertex may scatter.
inline Scattering light_sources(const SceneView& scene, const VertexMemory& memory, const Vertex& v,
                                Mask stays, Vec3 position, Int material, Vec3 incoming, Int next,
                                bool geometry) {
    Scattering s;
    const Int light_face = load(v.light_face), light_row = load(v.light_row);
    s.thrown = s.throws = s.throws_beyond = s.beyond = s.thrown_beyond = splat(0);
    if (scene.thrown_alpha > 0.0f) {
        s.throws_beyond = select(stays, load(v.throws), splat(0));
        const Mask of_table = stays & (light_row >= 0);
        s.thrown = of_table & (load(v.thrown) != 0);
        s.throws = select(of_table & ~s.thrown, s.throws_beyond, splat(0));
    }
    const Mask from_face = stays & (light_face >= 0), from_row = stays & (light_row >= 0) & ~s.thrown;
    s.light = from_face | from_row;
    s.followed = followed_for(scene, from_row, light_row);
    s.light_visible_to = load(v.light_visible_to);
    s.light_w = s.environment_w = load3(v.direction), s.light_value = s.environment_value = zero3();
    s.fixed = s.veiled = splat(0);
    s.kept = one3();
    // After perfect mirrors and smooth glass x is in screen form, so light stays in material form
    // (derivations, K).
    Mask may_fix = splat(0);
    if (geometry && scene.face_fixed_direction)
        may_fix = receives_held(
            scene, stays & (load(v.face) >= 0) & (~load(v.screen_form) | (load(v.kind) == splat(kCameraRay))),
            material);
    // Collect light from emitter samples
    const auto take = [&](Mask m, const LightArrival& a) {
        s.light_w = select(m, a.w, s.light_w);
        s.light_value = select(m, a.radiance * load3(v.light_scale) * a.measure, s.light_value);
    };
    if (any(from_face)) {
        const Triangle t = gather_triangle(scene, select(from_face, light_face, splat(0)));
        const Mask fixed = holds_direction(scene, from_face & may_fix, light_face, material);
        take(from_face, light_of_face(scene, from_face, t, light_face, load(v.light_b1), load(v.light_b2),
                                      position, light_motion(scene, v, from_face & ~fixed)));
    }
    if (any(from_row))
        take(from_row,
             light_of_row(scene, from_row, light_row, load(v.light_kind), load3(v.light_offset), position));
    // Collect light from samples of the environment's image
    const Vec3 environment_scale = load3(v.environment_scale);
    s.environment = stays & (largest_component(environment_scale) > 0.0f);
    if (any(s.environment)) {
        s.environment_w = turned_with_environment(scene, load3(v.environment_direction));
        s.environment_value = environment_radiance(scene, s.environment_w) * environment_scale;
    }

    // Collect light along the ray that continues
    const Vec3 last_scale = load3(v.last_scale), wi = load3(v.next_direction);
    const Mask continues = stays & load(v.continues), follows = continues & ~load(v.specular);
    s.specular = continues & load(v.specular);
    s.last = stays & (largest_component(last_scale) > 0.0f);
    s.next = follows | s.last;
    if (scene.thrown_alpha > 0.0f && scene.has_environment) {
        s.beyond = follows & ends_in_environment(memory, next);
        const Mask shines =
            s.beyond & (constant(next_floats(memory, s.beyond, next, &Vertex::environment_weight)) > 0.0f);
        s.thrown_beyond = shines & (load(v.thrown_scale) > 0.0f);
    }
    s.next_w = wi;
    s.next_value = incoming * load(v.next_scale);
    if (scene.has_environment && any(s.next)) {
        s.next_w = select(s.last | ends_in_environment(memory, next), turned_with_environment(scene, wi), wi);
        if (any(s.last))
            s.next_value = select(s.last, environment_radiance(scene, s.next_w) * last_scale, s.next_value);
    }
    // Let the next vertex move
    if (geometry && any(follows)) {
        const Int face = next_ints(memory, follows, next, &Vertex::face);
        const Mask surface = follows & (next >= 0) & (face >= 0);
        if (any(surface)) {
            const auto [t, instance, b1, b2] = next_point(scene, memory, surface, face, next);
            // Emission of the surface has a fixed direction; light that it scatters is in material form.
            Mask fixed = holds_direction(scene, surface & may_fix & (instance < 0), face, material);
            if (any(fixed)) {
                const Vec3 emission = select(fixed, emission_of_next(scene, memory, fixed, next), zero3());
                const Vec3 rest = incoming - emission;
                s.fixed = fixed & (largest_component(rest) > 0.0f);
                s.fixed_w = wi, s.fixed_value = emission * load(v.next_scale);
                s.next_value = select(s.fixed, rest * load(v.next_scale), s.next_value);
                fixed &= ~s.fixed;
            }
            // Differentiate the segment to the next vertex
            FarMotion motion = far_motion(surface & ~fixed);
            if (scene.mesh_contact) {
                motion.material_form =
                    motion.material_form - next_floats(memory, surface, next, &Vertex::fixed_weight);
                motion.drift = next_drift(memory, surface, next);
            }
            const Segment y = segment_to(position, t, b1.value, b2.value, motion);
            s.next_w = select(surface, y.w, s.next_w);
            s.next_value = select(surface, s.next_value * y.measure, s.next_value);
        }
    }
    return s;
}

// Attenuates the light by the transparent surfaces on the vertex' shadow rays.
inline void pass_transparent_surfaces(const SceneView& scene, const VertexMemory& memory, const Vertex& v,
                                      Vec3 position, Scattering& s, bool geometry) {
    const TransparentMemory& passed = memory.passed;
    const auto vertex = static_cast<int32_t>(&v - &memory.at<W>(0));
    for (int64_t k = passed.first_of<W>(vertex); k < passed.count; ++k) {
        const TransparentPacket<W>& p = passed.at<W>(k);
        if (p.vertex != vertex) break;
        const Mask some = load(p.face) >= 0;
        const auto dim = [&](Mask light, Vec3 w, Vec3& value, Mask near, Vec3 y) {
            const Mask m = light & some;
            if (any(m))
                value =
                    select(m, value * transparent_share(scene, p, m, position, w, near, y, geometry), value);
        };
        if (p.ray == kRayToLight) {
            const Int kind = load(v.light_kind);
            const Mask distant =
                (load(v.light_row) >= 0) & ((kind == splat(kDirectionLight)) | (kind == splat(kConeLight)));
            dim(s.light, s.light_w, s.light_value, ~distant, detach(position) + load3(v.light_offset));
        }
        if (p.ray == kRayToEnvironment)
            dim(s.environment, s.environment_w, s.environment_value, splat(0), zero3());
        if (p.ray == kLastRay)
            dim(s.last, s.next_w, s.next_value, splat(0), zero3()), s.veiled |= s.last & some;
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
