// Blocks of the tape beside the operations that they replace (adjoint/blocks.h), for tests. Values are those
// of the plain operations, derivatives those of the blocks.
#pragma once

#include "adjoint/blocks.h"
#include "adjoint/scene_probe_packet.h"
#include "adjoint/segment_block.h"

namespace edgegrad::EDGEGRAD_ISA {

EG_INLINE Float beside(Float plain, Float block) { return {plain.value, block.node}; }
EG_INLINE Vec3 beside(Vec3 plain, Vec3 block) {
    return {beside(plain.x, block.x), beside(plain.y, block.y), beside(plain.z, block.z)};
}

EG_INLINE Triangle constant_triangle(const Triangle& t) { return {detach(t.p0), detach(t.p1), detach(t.p2)}; }

// Hit points: faces of odd index in screen form, along a ray from a to near one of their points; the others
// in material form.
EG_INLINE void probe_met_point(const SceneView& scene, SceneProbePacket& p) {
    const PlacedTriangle t = placed_triangle(scene, p.index, p.instance);
    const Triangle& f = t.triangle;
    const Mask screen_form = p.active & ((p.index & 1) != 0);
    const Vec3 from = p.a, direction = interpolate(f, splat(0.3f), splat(0.2f)) + p.b * splat(0.2f) - from;
    const Vec3 e1 = f.p1 - f.p0, e2 = f.p2 - f.p0, s = from - f.p0, q = cross(s, direction);
    const Float inverse = 1.0f / dot(direction, cross(e1, e2));
    const Float b1 = select(screen_form, -dot(e2, q) * inverse, splat(0.3f));
    const Float b2 = select(screen_form, dot(e1, q) * inverse, splat(0.2f));
    const SurfacePoint plain =
        surface_point(scene, p.active, p.index, t, b1, b2, detach(direction), p.instance);
    SurfacePoint x = surface_point(scene, p.active, p.index, {constant_triangle(f), detach(t.handed)},
                                   detach(b1), detach(b2), detach(direction), p.instance);
    move_met_point(x, f, all_of(screen_form), from, direction);
    p.put(0, beside(plain.position, x.position));
    p.put(3, beside(plain.normal, x.normal));
    p.output[6] = beside(b1, x.b1), p.output[7] = beside(b2, x.b2);
}

// Segments from a to a point of a triangle, and to the point b of a surface. Every second surface has no
// size.
EG_INLINE void probe_segments(const SceneView& scene, SceneProbePacket& p) {
    const auto plain = [](Vec3 d, Vec3 m, Vec3& w) {
        const Float square = dot(d, d);
        w = d * (1.0f / sqrt(square));
        return log(abs(dot(w, m)) / square);
    };
    const Triangle t = gather_triangle(scene, p.index);
    const Segment face = segment_to(p.a, t, raw::splat(0.3f), raw::splat(0.2f), far_motion(p.active));
    Vec3 w;
    const Float measure = plain(interpolate(t, splat(0.3f), splat(0.2f)) - p.a, area_normal(t), w);
    p.put(0, beside(w, face.w));
    p.output[3] = beside(measure, face.measure);
    const Mask point = (p.index & 1) != 0;
    const Segment light = segment_to(p.a, p.b, t.p0, point);
    const Vec3 d = p.b - p.a;
    const Float by_area = plain(d, t.p0, w);
    p.put(4, beside(w, light.w));
    p.output[7] = beside(select(point, -log(dot(d, d)), by_area), light.measure);
}

// Diffuse reflection of light from two directions, and from a third on every second surface; and a unit
// vector.
EG_INLINE void probe_reflection(const SceneView& scene, SceneProbePacket& p) {
    const Triangle t = gather_triangle(scene, p.index);
    const DiffuseLight lights[] = {
        {p.active, p.b, t.p1}, {p.active, t.p2, p.b}, {p.active & ((p.index & 1) != 0), t.p1, p.a}};
    Vec3 sum = zero3();
    for (const DiffuseLight& light : lights) {
        const Float cosine = max(dot(p.a, light.w), 0.0f);
        sum = sum + select(light.active, t.p0 * light.value * (cosine * kInvPi), zero3());
    }
    p.put(0, beside(sum, diffuse_reflection(p.a, t.p0, 3, lights)));
    p.put(3, beside(p.b * (1.0f / sqrt(dot(p.b, p.b))), unit(p.b)));
}

}  // namespace edgegrad::EDGEGRAD_ISA
