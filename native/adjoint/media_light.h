// What media keep and scatter of a recorded vertex' light as a function of their coefficients:
//
//   exp(-sum over the media of a ray  s_t l),   l: way of the ray within the medium,
//
// whose ways are constants.
#pragma once

#include "adjoint/incident_light.h"
#include "shading/absorption.h"
#include "shading/phase_function.h"

namespace edgegrad::EDGEGRAD_ISA {

// The media at a vertex in a medium (MediumFloat).
struct MediumAround {
    Vec3 extinction, scattering;
    Float forward;
};

// An entry's row of coefficients.
EG_INLINE void medium_row(const SceneView& scene, const MediaPacket<W>& p, Float (&row)[kMediumFloats]) {
    const Int material = load(p.material);
    const Mask outside = material == splat(kWorldMedium);
    gather_row(scene.media, kMediumFloats, select(outside, splat(0), material), row);
    if (!any(outside)) return;
    for (int k = 0; k < kMediumFloats; ++k)
        row[k] = select(outside, broadcast(scene.world_medium + k), row[k]);
}

// Calls visit(entry) for a vertex' media.
template <typename Visit>
inline void for_each_medium(const VertexMemory& memory, const Vertex& v, const Visit& visit) {
    const auto vertex = static_cast<int32_t>(&v - &memory.at<W>(0));
    for (int64_t k = memory.media.first_of<W>(vertex); k < memory.media.count; ++k) {
        const MediaPacket<W>& p = memory.media.at<W>(k);
        if (p.vertex != vertex) break;
        visit(p);
    }
}

// The change of what is added up over media: 0, with a derivative.
EG_INLINE Float change_of(Float a) { return a - detach(a); }
EG_INLINE Vec3 change_of(Vec3 a) { return {change_of(a.x), change_of(a.y), change_of(a.z)}; }

// The change of exp(-depth) relative to its value: 1, with a derivative.
EG_INLINE Vec3 relative_change(Vec3 depth) { return kept_over(change_of(depth)); }

// The same over a distance, which may be infinite for rays that bring no light.
EG_INLINE Vec3 change_over(Vec3 extinction, Float distance) {
    return relative_change(extinction * select(distance < __builtin_inff(), distance, splat(0.0f)));
}

// The media around a vertex in a medium. Their recorded values contain the rounding of all surfaces along the
// ray (shading/media.h).
inline MediumAround medium_around(const SceneView& scene, const VertexMemory& memory, const Vertex& v) {
    MediumAround m{load3(v.medium_extinction), load3(v.medium_scattering), load(v.medium_forward)};
    for_each_medium(memory, v, [&](const MediaPacket<W>& p) {
        if (p.ray != kArrivingRay) return;
        Float row[kMediumFloats];
        medium_row(scene, p, row);
        const Float sign = load(p.sign);
        const auto add = [&](Float& to, int k) { to = to + change_of(row[k]) * sign; };
        const auto add3 = [&](Vec3& to, int k) { add(to.x, k), add(to.y, k + 1), add(to.z, k + 2); };
        add3(m.extinction, kMediumExtinction), add3(m.scattering, kMediumScattering);
        add(m.forward, kMediumForward);
    });
    return m;
}

// Attenuates the light of a vertex' shadow rays by the change of the media along them.
inline void pass_media(const SceneView& scene, const VertexMemory& memory, const Vertex& v, Scattering& s) {
    Vec3 depth[kArrivingRay] = {zero3(), zero3(), zero3()};
    for_each_medium(memory, v, [&](const MediaPacket<W>& p) {
        if (p.ray == kArrivingRay) return;
        Float row[kMediumFloats];
        medium_row(scene, p, row);
        const Float way = load(p.way);
        depth[p.ray] =
            depth[p.ray] +
            Vec3{row[kMediumExtinction], row[kMediumExtinction + 1], row[kMediumExtinction + 2]} * way;
    });
    s.kept = relative_change(depth[kRayToLight]);
    s.light_value = s.light_value * s.kept;
    s.environment_value = s.environment_value * relative_change(depth[kRayToEnvironment]);
    s.next_value = select(s.last, s.next_value * relative_change(depth[kLastRay]), s.next_value);
}

// Attenuates the light of a vertex' shadow rays by what they pass.
inline void pass_on_shadow_rays(const SceneView& scene, const VertexMemory& memory, const Vertex& v,
                                Vec3 position, Scattering& s, bool geometry) {
    if (memory.passed.count > 0) pass_transparent_surfaces(scene, memory, v, position, s, geometry);
    if (memory.media.count > 0) pass_media(scene, memory, v, s);
}

}  // namespace edgegrad::EDGEGRAD_ISA
