// Transmittance of a recorded vertex' shadow rays as a function of the scene:
//
//   T = product over the surfaces that the ray from x along w intersects of  t(c),   c = x + s w on each,
//
// where t is a surface's transparent share. It depends on the closure's values and, with textures, on the
// point c, which moves in screen form as x and w move (derivations, L).
#pragma once

#include "adjoint/field_surface.h"
#include "shading/surface_transmittance.h"

namespace edgegrad::EDGEGRAD_ISA {

// The factors t of a packet's surfaces on rays from `from` along the unit vectors w. The rays of `near` lanes
// end at the points y: where the shadow terminator lifts their origin, their direction differs from w.
inline Vec3 transparent_share(const SceneView& scene, const TransparentPacket<W>& p, Mask active, Vec3 from,
                              Vec3 w, Mask near, Vec3 y, bool geometry) {
    const Int face = select(active, load(p.face), splat(0));
    if (!scene.textures.closure_program) {
        // The share is the same at all points.
        SurfacePoint c{};
        c.active = active;
        c.material = gather(scene.face_material, face);
        return surface_transmittance(scene, c, TexturePoint{});
    }
    const Int instance = select(active, load(p.instance), splat(-1));
    PlacedTriangle t = placed_triangle(scene, face, instance);
    SurfacePoint c =
        surface_point(scene, active, face, detach(t), load(p.b1), load(p.b2), detach(w), instance);
    const Mask field = on_field(scene, active, face);
    if (any(field)) {
        t.triangle = select(field, c.triangle, t.triangle);
        if (geometry) move_settled_triangle(scene, field, face, t.triangle);
    }
    if (scene.any_terminator && any(near)) {
        const RawVec3 way = values(y) - values(c.position);
        const Vec3 turned = constant3(way * finite_inverse(raw::sqrt(dot(way, way))) - values(w));
        w = select(near, w + turned, w);
    }
    if (geometry) move_met_point(c, t.triangle, all_of(active), from, w);
    return surface_transmittance(scene, c, texture_point(scene, c, -w, splat(kShadowRay)));
}

}  // namespace edgegrad::EDGEGRAD_ISA
