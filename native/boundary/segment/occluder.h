// Occlusion and transparency of the faces of an edge, for light that passes it.
#pragma once

#include "boundary/segment/silhouette.h"
#include "shading/transmittance.h"

namespace edgegrad::EDGEGRAD_ISA {

// The side of a face of the edge, relative to the plane through the edge with normal `across`: +1, -1, or 0
// if it lies in the plane.
EG_INLINE int face_side(const SceneView& scene, const SegmentSample& p, uint32_t place, Vec3 across, int i) {
    float c[3];
    across_edge(scene, p, i, place, c);
    const float h = across.x[i] * c[0] + across.y[i] * c[1] + across.z[i] * c[2];
    return h > 0.0f ? 1 : h < 0.0f ? -1 : 0;
}

// Lanes whose edge has a transparent face.
EG_INLINE Mask transparent_occluder(const SceneView& scene, Mask active, Int edge) {
    Mask clear = splat(0);
    if (!(scene.all_flags & kHasTransparency)) return clear;
    for (int i = 0; i < W; ++i) {
        if (!active[i]) continue;
        for (uint32_t k = scene.edge_face_first[edge[i]]; k < scene.edge_face_first[edge[i] + 1]; ++k)
            if (material_has(scene, scene.face_material[scene.edge_faces[k]], kHasTransparency))
                clear[i] = -1;
    }
    return clear;
}

// Of these lanes, those in which the transmittance may differ between the two sides of the edge for light
// from any direction: the faces have different materials, or one material with a texture. All other edges
// count only where they are silhouettes.
EG_INLINE Mask parts_light(const SceneView& scene, Mask clear, Int edge) {
    Mask parted = splat(0);
    if (!any(clear)) return parted;
    const auto& textures = scene.textures;
    for (int i = 0; i < W; ++i) {
        if (!clear[i]) continue;
        const uint32_t first = scene.edge_face_first[edge[i]], last = scene.edge_face_first[edge[i] + 1];
        const int32_t material = scene.face_material[scene.edge_faces[first]];
        for (uint32_t k = first + 1; k < last; ++k)
            if (scene.face_material[scene.edge_faces[k]] != material) parted[i] = -1;
        for (int32_t closure = scene.material_first_closure[material];
             closure < scene.material_first_closure[material + 1]; ++closure)
            if ((textures.closure_program && textures.closure_program[closure] >= 0) ||
                (textures.closure_weight_program && textures.closure_weight_program[closure] >= 0))
                parted[i] = -1;
    }
    return parted;
}

// Lanes whose x lies on a face of the edge.
EG_INLINE Mask on_edge_face(const SceneView& scene, const SegmentSample& p, const SurfacePoint& x) {
    Mask on = splat(0);
    for (int i = 0; i < W; ++i) {
        if (!p.active[i] || p.instance[i] != x.instance[i]) continue;
        for (uint32_t k = scene.edge_face_first[p.edge[i]]; k < scene.edge_face_first[p.edge[i] + 1]; ++k)
            if (static_cast<int32_t>(scene.edge_faces[k]) == x.face[i]) on[i] = -1;
    }
    return on;
}

// T- - T+: the difference in transmittance of the edge's faces between the two sides of the plane through the
// edge. `across` points to the plus side. `towards` is the direction to the light. It is zero if both sides
// have equal transmittance.
EG_OUTLINE Vec3 transparent_jump(const SceneView& scene, const SegmentSample& p, Mask active, Float u,
                                 Vec3 across, Vec3 towards) {
    const Vec3 white = one3();
    Vec3 plus = white, minus = white;
    // Find the largest number of faces in any lane
    uint32_t most = 0;
    for (int i = 0; i < W; ++i) {
        const uint32_t count = scene.edge_face_first[p.edge[i] + 1] - scene.edge_face_first[p.edge[i]];
        if (active[i] && count > most) most = count;
    }
    // Multiply the transmittance of the faces on each side
    for (uint32_t k = 0; k < most; ++k) {
        Mask here = splat(0), above = splat(0);
        Int face = splat(0), opposite = splat(0);
        for (int i = 0; i < W; ++i) {
            const uint32_t place = scene.edge_face_first[p.edge[i]] + k;
            if (!active[i] || place >= scene.edge_face_first[p.edge[i] + 1]) continue;
            const int side = face_side(scene, p, place, across, i);
            if (side == 0) continue;
            here[i] = -1;
            above[i] = side > 0 ? -1 : 0;
            face[i] = static_cast<int32_t>(scene.edge_faces[place]);
            const int32_t* f = scene.faces + 3 * static_cast<int64_t>(face[i]);
            while (opposite[i] < 2 && f[opposite[i]] != static_cast<int32_t>(scene.edge_opposite[place]))
                ++opposite[i];
        }
        if (!any(here)) continue;
        Float b1, b2;
        edge_place(scene, select(here, p.edge, splat(0)), u, gather_triangle(scene, face), opposite, b1, b2);
        const SurfacePoint x = surface_point(scene, here, face, b1, b2, towards, p.instance);
        const Vec3 through =
            surface_transmittance(scene, x, texture_point(scene, x, -towards, splat(kShadowRay)));
        plus = select(here & above, plus * through, plus);
        minus = select(here & ~above, minus * through, minus);
    }
    return select(active, minus - plus, zero3());
}

}  // namespace edgegrad::EDGEGRAD_ISA
