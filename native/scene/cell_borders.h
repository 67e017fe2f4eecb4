// The borders of cells over which textures do not jump, as borders of contact (scene/contact.h).
#pragma once

#include "scene/geometry.h"

namespace edgegrad::EDGEGRAD_ISA {

// A coordinate of a grid of cells (scene/textures/jumps.h) at the corners of faces: row . (attribute, 1).
struct CellCorners {
    Float at[3];
};

// Where the corners of faces have an attribute: the place of the first value, and the number of components.
struct AttributePlace {
    Int first, components;
};

EG_INLINE AttributePlace attribute_place(const TextureView& textures, Mask active, Int attribute, Int face) {
    AttributePlace out{splat(0), splat(0)};
    for (int lane = 0; lane < W; ++lane) {
        if (!active[lane]) continue;
        const int64_t f = face[lane];
        const int64_t row = int64_t{attribute[lane]} * textures.mesh_count + textures.face_mesh[f];
        const TextureAttribute& a = textures.mesh_attributes[row];
        if (a.components <= 0) continue;  // one value for all corners, or none
        out.first[lane] = static_cast<int32_t>(a.offset + 3 * f * a.components);
        out.components[lane] = a.components;
    }
    return out;
}

EG_INLINE CellCorners cell_corners(const SceneView& scene, AttributePlace place, Int row) {
    CellCorners out;
    for (int corner = 0; corner < 3; ++corner) {
        Float sum = gather(scene.cell_rows + 3, row);
        for (int k = 0; k < 3; ++k) {
            const Int component = select(place.components == 1, splat(0), splat(k));
            const Mask there = component < place.components;
            const Int at = place.first + place.components * corner + component;
            const Float value = gather(scene.textures.attributes, select(there, at, splat(0)));
            sum = sum + select(there, gather(scene.cell_rows + k, row) * value, 0.0f);
        }
        out.at[corner] = sum;
    }
    return out;
}

// Calls add(lanes, distance, inward) for the nearest border of each grid and direction, for the points y of
// triangles `t` with the unit normal n.
template <typename Add>
EG_INLINE void for_each_cell_border(const SceneView& scene, Mask active, Int face, const Triangle& t, Vec3 n,
                                    Float twice_area, Vec3 y, const Add& add) {
    const Int known = select(active, face, splat(0));
    const Int material = gather(scene.face_material, known);
    Int grid = gather(scene.material_first_grid, material);
    const Int end = gather(scene.material_first_grid + 1, material);
    const Float inverse = 1.0f / max(twice_area, 1e-37f);
    // Gradients of the barycentrics
    const Vec3 b1 = cross(t.p2 - t.p0, n) * inverse, b2 = cross(n, t.p1 - t.p0) * inverse;
    for (Mask more = active & (grid < end); any(more); grid = grid + 1, more &= grid < end) {
        const Int here = select(more, grid, splat(0));
        const AttributePlace place =
            attribute_place(scene.textures, more, gather(scene.cell_attributes, here), known);
        for (int axis = 0; axis < kCellCoordinates; ++axis) {
            const CellCorners cell = cell_corners(scene, place, here * (4 * kCellCoordinates) + 4 * axis);
            const Vec3 slope = b1 * (cell.at[1] - cell.at[0]) + b2 * (cell.at[2] - cell.at[0]);
            const Float length = sqrt(dot(slope, slope));
            const Float inside = cell.at[0] + dot(slope, y - t.p0);
            const Float beyond = inside - floor(inside + 0.5f);
            const Float scale = 1.0f / max(length, 1e-30f);
            add(more & (place.components > 0) & (length > 0.0f), abs(beyond) * scale,
                slope * select(beyond < 0.0f, -scale, scale));
        }
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
