// Indirect boundary term: an edge between two surfaces that light each other, as seen in diffuse
// interreflection, glossy reflection or through rough glass.
//
// Formula (S) of the derivations (boundary/segment/segment.h), sampled from the edge outwards (derivations,
// I). e(u) is a point of an edge, and w a direction for which all faces of the edge are on one side. y is the
// first surface along -w, and x the first surface along w:
//   dI = int du int dw  W(x) L(y) sigma (t x w) . (de - lambda dx - (1 - lambda) dy).
// L(y) is the radiance that y scatters towards e, estimated by a path of the picture. The emission of y
// belongs to the shadow term. W(x) is the importance of light at x. If the camera sees x, it is f kappa
// |D . n|. Otherwise it is estimated by a chain of surfaces to the camera
// (boundary/segment/scattering_chain.h). Each sample chooses one length of that chain, so that each path
// length is estimated by separate samples.
//
// u is uniform on the sampled segment. w is sampled in the wedges about the edge
// (boundary/segment/silhouette.h). Where light passes that mirrors or smooth glass throw on other surfaces,
// some directions are aimed at where it comes from (boundary/samples/aimed_direction.h): small lights are
// hardly found otherwise.
#pragma once

#include "boundary/samples/aimed_direction.h"
#include "boundary/segment/indirect_connection.h"
#include "boundary/segment/occluder.h"
#include "boundary/segment/silhouette.h"
#include "tasks/boundary_task.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// A direction about an edge, or aimed, and the density of both together (balance heuristic).
EG_INLINE Vec3 aimed_or_about(const SceneView& scene, const BoundaryTask& task, const SegmentSample& p,
                              Mask parted, Vec3 point, Float& density) {
    Float u, v;
    const float cells = cell_numbers(task, p, u, v);
    const Aim aim = aim_from(task.beams, p.active, point);
    const Mask aimed = take_aimed(aim.known, v);
    Vec3 w = wedge_direction(scene, p, parted, u, v, density);
    if (any(aimed)) w = select(aimed, -aimed_direction(task.beams, aim, u, v), w);
    density = density_about(scene, task, p, parted, w, density * cells);
    if (!any(aim.known)) return w;
    const Float both = kAimed * cells * aimed_density(task.beams, aim, -w) + (1.0f - kAimed) * density;
    density = select(aim.known, both, density);
    return w;
}

// Samples the term without L(y) (connect_indirect).
EG_OUTLINE int sample_indirect(const SceneView& scene, const BoundaryTask& task,
                               const DerivativeView& requested, int at, SegmentCursor& cursor,
                               Workspace& work, int queued, BoundarySegment& s) {
    // Sample a point of an edge
    SegmentSample p = sample_edge_segment(scene, task, at, cursor);
    begin_segment(p, s);
    if (scene.rays_differ) s.active &= is_met(scene, s.edge, splat(kScatteredRays));
    // Silhouettes have a side sigma. Transparent faces have a jump of transmittance instead.
    p.active = s.active;
    const Mask clear = transparent_occluder(scene, s.active, s.edge);
    const Mask parted = parts_light(scene, clear, s.edge);
    // Sample a direction about the edge
    Float density;
    const Vec3 w = aimed_or_about(scene, task, p, parted, s.point, density), across = cross(p.t, w);
    s.towards = -w;
    const Float sigma = select(clear, splat(1.0f), occluder_side(scene, p, across));
    s.sweep = across * sigma;
    s.active &= sigma != 0.0f;
    if (!any(s.active)) return queued;
    return connect_indirect(
        scene, task, p, exit_of_edge(s), requested, (p.u1 - p.u0) / (density * p.density), at, work, queued,
        [&](Int path) EG_INLINE_LAMBDA { return find_source(scene, task, s, s.active, path, p.t, w); },
        [&]() EG_INLINE_LAMBDA {
            if (!any(clear & s.active)) return;
            s.color =
                select(clear, s.color * transparent_jump(scene, p, s.active & clear, s.u, across, s.towards),
                       s.color);
        },
        s);
}

}  // namespace edgegrad::EDGEGRAD_ISA
