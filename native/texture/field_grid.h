// Attributes of distance fields: values on grids over the fields' boxes, interpolated linearly along each
// axis.
//
// The value (i, j, k) of a grid of (nx, ny, nz) values stands at the fractions i / (nx - 1), j / (ny - 1) and
// k / (nz - 1) of the box. A grid of one value along an axis is constant along it.
#pragma once

#include "scene/geometry.h"
#include "texture/image.h"

namespace edgegrad::EDGEGRAD_ISA {

#ifdef EDGEGRAD_TAPED
// The points of fields, with the derivative of their motion relative to the fields, which may move
// (adjoint/field_frame.cpp).
Vec3 relative_to_fields(const SceneView& scene, Mask lanes, Int face, Vec3 position);

// A number that changes with the position by the factors `by`.
EG_INLINE Float changing_with(Vec3 position, Float value, const Vec3& by) {
    if ((position.x.node & position.y.node & position.z.node) < 0) return value;
    return value + dot(position - detach(position), by);
}
#else
EG_INLINE Vec3 relative_to_fields(const SceneView&, Mask, Int, Vec3 position) { return position; }
EG_INLINE Float changing_with(Vec3, Float value, const Vec3&) { return value; }
#endif

// Interpolates an attribute of the fields that the lanes have hit; 0 where a field does not have it.
EG_INLINE Color4 lookup_grid(const SceneView& scene, int32_t number, Mask lanes, Int face, Vec3 position) {
    const TextureGrid* of_field = scene.textures.field_grids + number * scene.field_count;
    Rows corner[8] = {};
    float place[3][W] = {}, slope[3][3][W] = {};
    Int components = splat(0);
    int most = 0;
    // Find the cell of each lane, and the place in it
    for (int lane = 0; lane < W; ++lane) {
        if (!lanes[lane]) continue;
        const int32_t k = face[lane] - scene.first_field_face;
        const TextureGrid& grid = of_field[k];
        if (grid.components == 0) continue;
        components[lane] = grid.components;
        if (grid.components > most) most = grid.components;
        const FieldView& field = scene.fields[k];
        const float point[3] = {position.x[lane], position.y[lane], position.z[lane]};
        double in_field[3];
        field.place_in_grid(point, in_field);
        int32_t first = 0, step[3], stride = grid.components;
        for (int a = 2; a >= 0; --a) {
            const int32_t last = grid.size[a] - 1;
            const double scale = static_cast<double>(last) / field.cells(a), at = scale * in_field[a];
            const bool inside = at >= 0.0 && at <= last;
            int32_t cell = inside ? static_cast<int32_t>(at) : at > 0.0 ? last : 0;
            if (cell == last && last > 0) --cell;
            const double within = at - cell;
            place[a][lane] = static_cast<float>(within < 0.0 ? 0.0 : within > 1.0 ? 1.0 : within);
            for (int c = 0; inside && c < 3; ++c)
                slope[a][c][lane] = static_cast<float>(scale * field.to_grid[a][c]);
            first += cell * stride;
            step[a] = last > 0 ? stride : 0;
            stride *= grid.size[a];
        }
        const auto start = static_cast<int32_t>(grid.offset) + first;
        for (int c = 0; c < 8; ++c)
            corner[c][lane] = start + (c & 4 ? step[0] : 0) + (c & 2 ? step[1] : 0) + (c & 1 ? step[2] : 0);
    }
    if (most == 0) return {splat(0.0f), splat(0.0f), splat(0.0f), splat(0.0f)};
    const Vec3 moving = relative_to_fields(scene, lanes, face, position);
    Float weight[3][2];
    for (int a = 0; a < 3; ++a) {
        weight[a][1] =
            changing_with(moving, load(place[a]), {load(slope[a][0]), load(slope[a][1]), load(slope[a][2])});
        weight[a][0] = 1.0f - weight[a][1];
    }
    Float of_corner[8];
    for (int c = 0; c < 8; ++c) of_corner[c] = weight[0][c >> 2] * weight[1][c >> 1 & 1] * weight[2][c & 1];
    return with_all_components(sum_texels(scene.textures.attributes, corner, of_corner, most), components);
}

}  // namespace edgegrad::EDGEGRAD_ISA
