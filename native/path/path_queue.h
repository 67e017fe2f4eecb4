// The queue of a task's live paths, and the state that a path carries from one surface to the next.
#pragma once

#include "shading/bsdf/distributions/tail.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// A packet of paths on one segment each.
struct PathPacket {
    Mask active;
    Int path;         // within the task
    Vec3 origin;      // where the ray starts
    Vec3 direction;   // unit
    Vec3 throughput;  // product of f |cos| / pdf
    Float pdf;        // solid-angle density of the direction; 0 if it has none (camera ray, specular lobe)
    RayLobe lobe;     // the followed lobe that scattered the ray
    Vec3 from;  // position and normal of the last scattering event; transparent surfaces may lie between
    Vec3 from_normal;
    Vec3 from_receiving;  // receiving_normal() there (shading/receiving_normal.h)
    Int from_mesh;
    Mask both_sides;  // that surface also scatters light to its back
    Int segment;      // number of this segment in its path, from 1
    Int vertex;       // number of surfaces met, transparent ones included; selects the random numbers
    Int kind;         // RayKind
    Mask touched;     // of recorded paths: has met a requested surface
    Mask past_rim;    // of paths that sample rims: has been scattered along one (path/rim.h)
    Mask led;         // scattered only by perfect and followed lobes (shading/bsdf/followed_lobes.h)
    Mask rough;       // scattered only by other lobes than these
    Mask unlit;       // emitter samples alone find lights of the table; such rays do not meet them
    Mask caustic;     // scattered by another lobe, and later by a perfect one
    Mask final_ray;   // finds emission but does not scatter again
    Int bounces;      // counts by kind, 8 bits each: diffuse, glossy, transmission, transparent surfaces
};

constexpr int kVertexBits = 11, kSegmentBits = 10;

EG_INLINE Int pack_state(const PathPacket& p) {
    return p.segment | (p.vertex << kSegmentBits) | (p.kind << (kSegmentBits + kVertexBits)) |
           ((p.final_ray & 1) << (kSegmentBits + kVertexBits + 3)) |
           ((p.both_sides & 1) << (kSegmentBits + kVertexBits + 4)) |
           ((p.touched & 1) << (kSegmentBits + kVertexBits + 5)) |
           ((p.led & 1) << (kSegmentBits + kVertexBits + 6)) |
           ((p.caustic & 1) << (kSegmentBits + kVertexBits + 7)) |
           ((p.past_rim & 1) << (kSegmentBits + kVertexBits + 8)) |
           ((p.unlit & 1) << (kSegmentBits + kVertexBits + 9)) |
           ((p.rough & 1) << (kSegmentBits + kVertexBits + 10));
}

EG_INLINE void unpack_state(Int state, PathPacket& p) {
    p.segment = state & ((1 << kSegmentBits) - 1);
    p.vertex = (state >> kSegmentBits) & ((1 << kVertexBits) - 1);
    p.kind = (state >> (kSegmentBits + kVertexBits)) & 7;
    p.final_ray = ((state >> (kSegmentBits + kVertexBits + 3)) & 1) != 0;
    p.both_sides = ((state >> (kSegmentBits + kVertexBits + 4)) & 1) != 0;
    p.touched = ((state >> (kSegmentBits + kVertexBits + 5)) & 1) != 0;
    p.led = ((state >> (kSegmentBits + kVertexBits + 6)) & 1) != 0;
    p.caustic = ((state >> (kSegmentBits + kVertexBits + 7)) & 1) != 0;
    p.past_rim = ((state >> (kSegmentBits + kVertexBits + 8)) & 1) != 0;
    p.unlit = ((state >> (kSegmentBits + kVertexBits + 9)) & 1) != 0;
    p.rough = ((state >> (kSegmentBits + kVertexBits + 10)) & 1) != 0;
}

// Number of bounces of a kind so far (kDiffuseRay, kGlossyRay, kTransmissionRay; 4: transparent).
EG_INLINE Int bounce_count(Int bounces, Int kind) {
    Int n;
    for (int i = 0; i < W; ++i) n[i] = (bounces[i] >> (8 * (kind[i] - 1) & 31)) & 255;
    return n;
}
// Number of bounces in media: all others have counts of their own.
EG_INLINE Int medium_bounces(const PathPacket& p) {
    Int n;
    for (int i = 0; i < W; ++i) {
        const int32_t b = p.bounces[i];
        n[i] = p.segment[i] - 1 - (b & 255) - (b >> 8 & 255) - (b >> 16 & 255);
    }
    return n;
}
// The sum is unsigned: from 128 on, the count in the uppermost byte would overflow a signed one.
EG_INLINE Int add_bounce(Int bounces, Mask m, Int kind) {
    for (int i = 0; i < W; ++i)
        if (m[i] && kind[i] != kMediumRay)
            bounces[i] =
                static_cast<int32_t>(static_cast<uint32_t>(bounces[i]) + (1u << (8 * (kind[i] - 1))));
    return bounces;
}

// Bounces before the surface at the end of the path's segment, and before the surface where it starts.
EG_INLINE Int bounces_before(const PathPacket& p) { return p.segment - 1; }
EG_INLINE Int bounces_before_last(const PathPacket& p) { return p.segment - 2; }

// Distance from the last scattering event to the ray's origin, which may lie behind transparent surfaces.
EG_INLINE Float way_so_far(const PathPacket& p) {
    const Vec3 way = p.origin - p.from;
    return sqrt(dot(way, way));
}

EG_INLINE void load3(Vec3& v, float* const p[3], int at) {
    v = {load(p[0] + at), load(p[1] + at), load(p[2] + at)};
}
EG_INLINE void store3(float* const p[3], int at, Vec3 v) {
    store(p[0] + at, v.x), store(p[1] + at, v.y), store(p[2] + at, v.z);
}
// Writes the values of the lanes of a mask and keeps the others.
EG_INLINE void put3(float* const p[3], int at, Mask m, Vec3 v) {
    Vec3 others;
    load3(others, p, at);
    store3(p, at, select(m, v, others));
}
EG_INLINE void append3(float* const p[3], int n, Mask m, Vec3 v) {
    append(p[0], n, m, v.x);
    append(p[1], n, m, v.y);
    append(p[2], n, m, v.z);
}

EG_INLINE PathPacket load_paths(const PathQueue& q, int at, int count) {
    PathPacket p;
    p.active = first_lanes(count - at);
    p.path = select(p.active, load(q.path + at), splat(0));
    load3(p.origin, q.origin, at);
    load3(p.direction, q.direction, at);
    load3(p.throughput, q.throughput, at);
    load3(p.from, q.from, at);
    load3(p.from_normal, q.from_normal, at);
    load3(p.from_receiving, q.from_receiving, at);
    p.pdf = load(q.pdf + at);
    p.lobe = {load(q.lobe_alpha + at), load(q.lobe_slope2 + at)};
    p.bounces = load(q.bounces + at);
    p.from_mesh = select(p.active, load(q.from_mesh + at), splat(0));
    unpack_state(load(q.state + at), p);
    p.kind = select(p.active, p.kind, splat(0));
    return p;
}

EG_INLINE int append_paths(PathQueue& q, int n, const PathPacket& p) {
    append3(q.origin, n, p.active, p.origin);
    append3(q.direction, n, p.active, p.direction);
    append3(q.throughput, n, p.active, p.throughput);
    append3(q.from, n, p.active, p.from);
    append3(q.from_normal, n, p.active, p.from_normal);
    append3(q.from_receiving, n, p.active, p.from_receiving);
    append(q.pdf, n, p.active, p.pdf);
    append(q.lobe_alpha, n, p.active, p.lobe.alpha);
    append(q.lobe_slope2, n, p.active, p.lobe.slope2);
    append(q.bounces, n, p.active, p.bounces);
    append(q.from_mesh, n, p.active, p.from_mesh);
    append(q.state, n, p.active, pack_state(p));
    return append(q.path, n, p.active, p.path);
}

}  // namespace edgegrad::EDGEGRAD_ISA
