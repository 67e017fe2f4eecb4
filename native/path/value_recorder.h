// Records what derivatives by colours and strengths need of paths (tasks/records/value_record.h). Only the
// latest packet is written to.
#pragma once

#include "path/recorder.h"
#include "tasks/records/value_record.h"

namespace edgegrad::EDGEGRAD_ISA {

using Values = ValuePacket<W>;

EG_INLINE Int light_source(LightSource table, Int row) { return (row << kSourceBits) | splat(table); }

// Which light sources contribute to a requested derivative.
EG_INLINE bool requests_environment(const ValueMemory& m) { return m.colors || m.environment; }
EG_INLINE bool requests_emission(const ValueMemory& m) { return m.colors || m.emission; }
EG_INLINE bool requests_rows(const ValueMemory& m) { return m.colors || m.rows; }
EG_INLINE bool requests_lights(const ValueMemory& m) { return requests_emission(m) || requests_rows(m); }
// The same for sources that rays can meet; they cannot meet lights without size.
EG_INLINE bool requests_met_light(const SceneView& scene, const ValueMemory& m) {
    return requests_environment(m) || requests_emission(m) ||
           (requests_rows(m) && scene.lights.all_sized() > 0);
}

EG_INLINE void add3(Values::Floats (&field)[3], Mask m, Vec3 a) {
    put3(field, m, Vec3{load(field[0]), load(field[1]), load(field[2])} + a);
}

// Records the rays of a packet.
EG_INLINE Values& record_values(ValueMemory& memory, const PathPacket& p, Mask active) {
    Values& v = memory.append<W>();
    store(v.active, active);
    store(v.path, p.path);
    store(v.face, splat(-1));
    store(v.instance, splat(-1));
    store(v.closure, splat(-1));
    set3(v.throughput, active, p.throughput);
    const Float one = select(active, splat(1.0f), 0.0f);
    for (auto& field : v.color) store(field, one);
    store(v.scale, one);
    return v;
}

// Records the surfaces that rays have met, and the weight of their shader.
EG_INLINE void record_surface(ValueMemory& memory, Mask hit, const Closest& closest, Float scale,
                              Mask touched) {
    Values& v = memory.latest<W>();
    put(v.face, hit, closest.face);
    put(v.instance, hit, closest.instance);
    put(v.scale, hit, scale);
    keep_touched(memory, v, touched);
}

// Records light that a ray finds by itself: `gain` times the source's `strength`.
EG_INLINE void record_own(ValueMemory& memory, Mask m, Int source, Vec3 strength, Vec3 gain) {
    Values& v = memory.latest<W>();
    put(v.own_source, m, source);
    put3(v.own_gain, m, gain);
    put3(v.own, m, strength * gain);
}

// Records a light of the table that rays meet between surfaces.
EG_INLINE void record_met_light(ValueMemory& memory, const PathPacket& p, Mask seen, int row, Vec3 radiance,
                                Vec3 gain) {
    Values& v = record_values(memory, p, seen);
    record_own(memory, seen, light_source(kRowSource, splat(row)), radiance, gain);
    set3(v.next_gain, seen, one3());
}

// Records that paths pass a transparent surface, which multiplies their light by `color`.
EG_INLINE void record_passing(ValueMemory& memory, Mask passes, Vec3 color) {
    put3(memory.latest<W>().next_gain, passes, color);
}

// Records the albedo of Lambertian surfaces.
EG_INLINE void record_color(ValueMemory& memory, Mask m, Int closure, Vec3 color) {
    Values& v = memory.latest<W>();
    put(v.closure, m, closure);
    put3(v.color, m, color);
}

// Albedo of the latest packet's surfaces, which multiplies the throughput; 1 where they are not Lambertian.
EG_INLINE Vec3 scattering_color(const ValueMemory& memory) {
    const Values& v = memory.latest<W>();
    return {load(v.color[0]), load(v.color[1]), load(v.color[2])};
}

// Records that the light of continuing rays is multiplied by `gain`.
EG_INLINE void record_next(ValueMemory& memory, Mask goes_on, Vec3 gain) {
    put3(memory.latest<W>().next_gain, goes_on, gain);
}

// Selects emitter samples that contribute: bright ones, and dark ones whose strength is requested.
EG_INLINE Mask gives(const ValueMemory& m, const LightSample& s) {
    const Mask strength = select(s.row >= 0, splat(m.rows ? -1 : 0), splat(m.emission ? -1 : 0));
    return m.colors ? strength | (largest_component(s.radiance) > 0.0f) : strength;
}

// Records an emitter sample. Its light is `gain` times the source's strength.
EG_INLINE void record_received(const SceneView& scene, ValueMemory& memory, const LightSample& s, Vec3 gain) {
    Values& v = memory.latest<W>();
    const Mask on_surface = s.face >= 0;
    const Int material = gather(scene.face_material, select(s.active & on_surface, s.face, splat(0)));
    put(v.light_source, s.active,
        select(on_surface, light_source(kLeafSource, gather(scene.material_first_closure, material)),
               light_source(kRowSource, s.row)));
    put3(v.light_gain, s.active, gain * select(on_surface, splat(1.0f), s.share));
    add3(v.received, s.active, s.radiance * gain);
}

// Records scattered environment light: `gain` times the environment's colour.
EG_INLINE void record_environment(const SceneView& scene, ValueMemory& memory, Mask m, Vec3 gain) {
    Values& v = memory.latest<W>();
    add3(v.environment_gain, m, gain);
    add3(v.received, m, gain * splat3(scene.environment));
}

}  // namespace edgegrad::EDGEGRAD_ISA
