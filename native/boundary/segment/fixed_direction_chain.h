// The motion of path vertices whose next vertex is parametrised by a fixed direction near contact
// (scene/contact.h). Vertex x = x_k slides along the ray from x_(k-1) with the blending weight b_k and moves
// with its surface with the weight 1 - b_k. So does x_(k-1), and so on down to x_1, which slides along the
// camera's ray (derivations, C5):
//   dx_k = (1 - b_k) m(x_k) + b_k (dx_(k-1) + w n . (m(x_k) - dx_(k-1))/(n . w)).
// In reverse, with g the adjoint of dx_k, b_k (g - n (g . w)/(n . w)) is the adjoint of dx_(k-1). The rest of
// g is the adjoint of m(x_k).
#pragma once

#include "boundary/samples/moving_points.h"
#include "path/camera_projection.h"
#include "reparameterisation/camera_blocks.h"
#include "scene/contact.h"

namespace edgegrad::EDGEGRAD_ISA {

// A surface between x and the camera.
struct FixedDirectionSurface {
    Int face, instance;
    Float b1, b2;
    Vec3 normal;
    Vec3 w;       // unit, to the next vertex towards x
    Float blend;  // b of the next vertex
};

// The surfaces of a chain, starting at the camera.
struct FixedDirectionChain {
    Int length;  // 0: x moves with its surface alone
    FixedDirectionSurface surface[kFixedDirectionSurfaces];
};

// Sets surface number k (from 0) of the chain in some lanes. `next` is the next vertex towards x.
EG_INLINE void set_chain_surface(const SceneView& scene, Mask active, Int k, const SurfacePoint& from,
                                 const SurfacePoint& next, FixedDirectionChain& chain) {
    const Float blend = contact(scene, active, from.mesh, from.position, from.normal, next.mesh, next.face,
                                next.instance, next.triangle, next.position)
                            .share;
    const Vec3 w = unit_vector(next.position - from.position);
    for (int i = 0; i < kFixedDirectionSurfaces; ++i) {
        const Mask here = active & (k == i);
        if (!any(here)) continue;
        FixedDirectionSurface& h = chain.surface[i];
        h.face = select(here, from.face, h.face), h.instance = select(here, from.instance, h.instance);
        h.b1 = select(here, from.b1, h.b1), h.b2 = select(here, from.b2, h.b2);
        h.normal = select(here, from.normal, h.normal), h.w = select(here, w, h.w);
        h.blend = select(here, blend, h.blend);
    }
}

// Starts a chain of `length` surfaces between x and the camera. Longer chains than
// scene.fixed_direction_surfaces get length 0.
EG_INLINE void begin_fixed_direction_chain(const SceneView& scene, Mask active, Int length,
                                           FixedDirectionChain& chain) {
    chain.length = select(active & (length <= scene.fixed_direction_surfaces), length, splat(0));
    const Int none = splat(0);
    for (FixedDirectionSurface& h : chain.surface)
        h = {none, splat(-1), splat(0.0f), splat(0.0f), zero3(), zero3(), splat(0.0f)};
}

// Adds the blocks of all surfaces of the chain, with g the adjoint of x. Returns the adjoint of the material
// velocity of x. This is `to_x` in lanes without a chain.
template <typename Mode>
EG_INLINE Vec3 fixed_direction_blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                                      Mask active, const FixedDirectionChain& chain, const SurfacePoint& x,
                                      const Projection& view, Vec3 g, Vec3 to_x, Vec3 color) {
    Mask carried = splat(0);  // lanes whose surface k has an adjoint
    for (int k = kFixedDirectionSurfaces; k >= 1; --k) {
        const FixedDirectionSurface& by = chain.surface[k - 1];
        const Mask starts = active & (chain.length == k), here = (starts | carried) & (by.blend > 0.0f);
        const FixedDirectionSurface& own = chain.surface[k < kFixedDirectionSurfaces ? k : 0];
        const Vec3 n = select(starts, x.normal, own.normal);
        const Vec3 of_ray =
            select(here, (g - n * (dot(g, by.w) / select(here, dot(n, by.w), 1.0f))) * by.blend, zero3());
        const Vec3 of_material = g - of_ray;
        to_x = select(starts, of_material, to_x);
        if (any(carried))
            face_point_blocks(mode, scene, motion, carried, own.face, own.instance, own.b1, own.b2,
                              of_material, color);
        g = select(starts | carried, of_ray, g);
        carried = here;
    }
    if (!any(carried)) return to_x;
    const FixedDirectionSurface& first = chain.surface[0];
    const Float facing = dot(first.normal, view.across_of);
    const Vec3 of_plane = first.normal * (dot(g, view.across_of) / select(carried, facing, 1.0f));
    face_point_blocks(mode, scene, motion, carried, first.face, first.instance, first.b1, first.b2, of_plane,
                      color);
    camera_blocks(mode, scene, motion, carried, view, g - of_plane, color);
    return to_x;
}

}  // namespace edgegrad::EDGEGRAD_ISA
