// Light of a recorded vertex' shadow rays that surfaces between let through, as a function of the scene:
//
//   T = product over the surfaces that the ray from x along w passes of  t(c),   c = x + s w on each,
//
// with t a surface's transparent share, which its shader's values change, and where textures vary it also the
// place c: it slides along the ray while that moves with x and w (derivations, L).
#pragma once

#include "adjoint/blocks.h"
#include "shading/surface_transmittance.h"
#include "tasks/vertex_record.h"

namespace edgegrad::EDGEGRAD_ISA {

// t of the surfaces of a packet, on rays from `from` along the unit vectors w; of lanes that are `near`, to
// the points y, and so along another vector where the shadow terminator's offset lifts their start.
inline Vec3 transparent_share(const SceneView& scene, const TransparentPacket<W>& p, Mask active, Vec3 from,
                              Vec3 w, Mask near, Vec3 y, bool geometry) {
    const Int face = select(active, load(p.face), splat(0));
    if (!scene.textures.closure_program) {
        // It is the same everywhere.
        SurfacePoint c{};
        c.active = active;
        c.material = gather(scene.face_material, face);
        return surface_transmittance(scene, c, TexturePoint{});
    }
    const Int instance = select(active, load(p.instance), splat(-1));
    const PlacedTriangle t = placed_triangle(scene, face, instance);
    SurfacePoint c =
        surface_point(scene, active, face, detach(t), load(p.b1), load(p.b2), detach(w), instance);
    if (scene.any_terminator && any(near)) {
        const RawVec3 way = values(y) - values(c.position);
        const Vec3 turned = constant3(way * finite_inverse(raw::sqrt(dot(way, way))) - values(w));
        w = select(near, w + turned, w);
    }
    if (geometry) move_met_point(c, t.triangle, all_of(active), from, w);
    return surface_transmittance(scene, c, texture_point(scene, c, -w, splat(static_cast<int>(kShadowRay))));
}

}  // namespace edgegrad::EDGEGRAD_ISA
