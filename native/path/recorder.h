// Records the vertices of paths whose derivatives are computed (tasks/records/vertex_record.h).
#pragma once

#include "path/path_queue.h"
#include "scene/contact.h"
#include "shading/bsdf/sample.h"
#include "shading/lights/lights.h"
#include "tasks/image_task.h"
#include "tasks/records/vertex_record.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

using Vertex = VertexPacket<W>;

// Returns the surfaces for which the task's paths are recorded; null if no paths are recorded.
EG_INLINE const RequestedSurfaces* requested_surfaces(const Workspace& work) {
    return work.vertices ? &work.vertices->requested : work.values ? &work.values->requested : nullptr;
}

EG_INLINE Mask is_requested(const RequestedSurfaces& requested, Int closure) {
    return (closure >= requested.first_closure) & (closure < requested.last_closure);
}

// Selects lanes that can still contribute: their path has met a requested surface, or may meet one later.
EG_INLINE Mask may_touch(const RequestedSurfaces& requested, const ImageTask& task, const PathPacket& p,
                         Mask hit) {
    const Mask scatters = ~p.final_ray & (p.segment + 1 < task.max_depth);
    return p.touched | (hit & (requested.first_closure < requested.last_closure ? splat(-1) : scatters));
}

// Writes the values of the lanes of a mask and keeps the others.
EG_INLINE void put(float* field, Mask m, Float a) { store(field, select(m, a, load(field))); }
EG_INLINE void put(int32_t* field, Mask m, Int a) { store(field, select(m, a, load(field))); }
EG_INLINE void put3(Vertex::Floats (&field)[3], Mask m, Vec3 a) {
    put(field[0], m, a.x), put(field[1], m, a.y), put(field[2], m, a.z);
}

// Writes the values of the lanes of a mask and sets the others to 0.
EG_INLINE void set(float* field, Mask m, Float a) { store(field, select(m, a, 0.0f)); }
EG_INLINE void set3(Vertex::Floats (&field)[3], Mask m, Vec3 a) {
    set(field[0], m, a.x), set(field[1], m, a.y), set(field[2], m, a.z);
}

// Records the rays of a packet and their hits.
EG_INLINE void record_arrival(const SceneView& scene, Vertex& v, const PathPacket& p, Mask hit,
                              const Closest& closest) {
    store(v.active, p.active);
    store(v.path, p.path);
    store(v.number, p.vertex);
    store(v.touched, p.touched);
    store(v.screen_form, p.active & (p.pdf == 0.0f));
    if (scene.light_followed) store(v.lobe_alpha, p.lobe.alpha), store(v.lobe_slope2, p.lobe.slope2);
    store(v.kind, p.kind);
    store(v.bounces, p.bounces);
    if (scene.lights.any_bounded) store(v.bounces_before_last, bounces_before_last(p));
    set3(v.from, p.active, p.from);
    set3(v.direction, p.active, p.direction);
    set3(v.throughput, p.active, p.throughput);
    store(v.face, select(hit, closest.face, splat(-1)));
    store(v.mesh, closest.mesh & hit);
    store(v.instance, select(hit, closest.instance, splat(-1)));
    set(v.b1, hit, closest.b1);
    set(v.b2, hit, closest.b2);
    const Float near = way_so_far(p);
    set(v.near, p.active, near);
    set(v.far, p.active, select(hit, near + closest.distance, splat(__builtin_inff())));
    store(v.from_mesh, p.from_mesh);
    store(v.light_face, splat(-1));
    store(v.light_row, splat(-1));
    set(v.scale, p.active, splat(1.0f));
}

// Records where the direction from the previous vertex to x is fixed (scene/contact.h).
EG_INLINE void record_contact(const SceneView& scene, Vertex& v, const PathPacket& p, const SurfacePoint& x) {
    if (!scene.mesh_contact) return;
    const Mask eligible = (p.segment >= 2) & (p.segment <= scene.fixed_direction_surfaces + 1) &
                          (p.pdf > 0.0f) & (p.kind != splat(kMediumRay));
    const Contact c = contact(scene, x.active & eligible, p.from_mesh, p.from, p.from_normal, x.mesh, x.face,
                              x.instance, x.triangle, x.position);
    set(v.fixed_weight, x.active, c.share);
    set3(v.drift, x.active, c.drift);
}

// Records where the direction from x to an emitter sample is fixed.
EG_INLINE void record_light_contact(const SceneView& scene, Vertex& v, const PathPacket& p,
                                    const SurfacePoint& x, const LightSample& s) {
    if (!scene.mesh_contact) return;
    const Mask eligible =
        s.active & (s.face >= 0) & (x.face >= 0) & (p.segment <= scene.fixed_direction_surfaces);
    const Contact c = contact_with_face(scene, eligible, x, s.face, splat(-1), s.b1, s.b2);
    put(v.light_fixed_weight, eligible, c.share);
    put3(v.light_drift, eligible, c.drift);
}

// Drops lanes that do not contribute to a derivative, and the latest packet if none of its lanes does. The
// packet's memory stays valid, so that the caller may still write to it.
template <typename Memory, typename Packet>
EG_INLINE void keep_touched(Memory& memory, Packet& v, Mask touched) {
    if (memory.requested.everywhere) return;
    const Mask kept = load(v.active) & touched;
    store(v.active, kept);
    if (!any(kept)) --memory.count;
}

EG_INLINE void record_light(Vertex& v, const LightSample& s, Vec3 scale) {
    put(v.light_face, s.active, s.face);
    put(v.light_row, s.active, s.row);
    put(v.light_kind, s.active, s.kind);
    put(v.light_visible_to, s.active, s.visible_to);
    put(v.light_b1, s.active, s.b1);
    put(v.light_b2, s.active, s.b2);
    put3(v.light_offset, s.active, s.w * select(s.distant, splat(1.0f), s.r));
    put3(v.light_scale, s.active, scale);
}

// Records a sample of thrown light (path/lights/thrown_light.h).
EG_INLINE void record_thrown(Vertex& v, Mask thrown, Int lobe, Vec3 half) {
    put(v.thrown, thrown, splat(1) << lobe);
    put3(v.thrown_half, thrown, half);
}

// Records the sampled direction of scattered lanes.
EG_INLINE void record_direction(Vertex& v, Mask sampled, const BsdfSample& s, bool lambertian) {
    put(v.samples, sampled, splat(-1));
    if (lambertian) put(v.diffuse, sampled, splat(-1));
    put(v.specular, sampled, s.specular);
    put(v.transmitted, sampled, s.transmitted);
    put(v.lobe, sampled, s.lobe);
    put3(v.half, sampled, s.half);
    put3(v.next_direction, sampled, s.wi);
    put(v.next_scale, sampled, 1.0f / max(s.pdf, 1e-30f));
}

// Records that a ray continues after Russian roulette with probability `survival`.
EG_INLINE void record_survival(Vertex& v, Mask goes_on, Float survival) {
    put(v.continues, goes_on, splat(-1));
    put(v.next_scale, goes_on, load(v.next_scale) * (1.0f / survival));
    put(v.thrown_scale, goes_on, load(v.thrown_scale) * (1.0f / survival));
}

}  // namespace edgegrad::EDGEGRAD_ISA
