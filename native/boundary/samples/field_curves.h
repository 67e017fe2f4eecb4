// Samples of curves on distance fields: outlines as a viewer sees them, and tangents of their surfaces.
#pragma once

#include "boundary/samples/segment_sampling.h"
#include "sdf/outline_point.h"
#include "sdf/surface_patch.h"

namespace edgegrad::EDGEGRAD_ISA {

// The face that stands for the field of each line.
EG_INLINE Int field_of_line(const SceneView& scene, Mask active, Int line) {
    Int face = splat(0);
    for (int i = 0; i < W; ++i)
        if (active[i]) face[i] = scene.surface_of_line(line[i], 0).face();
    return face;
}

EG_INLINE const FieldView& field_of_face(const SceneView& scene, int32_t face) {
    return scene.fields[face - scene.first_field_face];
}

EG_INLINE void set_lane3(Vec3& out, int lane, const float (&p)[3]) {
    out.x[lane] = p[0], out.y[lane] = p[1], out.z[lane] = p[2];
}

// Calls back with each sample's point of the outline on its segment, seen from viewer(lane, field). Samples
// without a point become inactive.
template <typename Viewer, typename Visit>
EG_INLINE void for_each_outline_point(const SceneView& scene, Mask& active, Int line, Float u,
                                      const Viewer& viewer, const Visit& visit) {
    for (int i = 0; i < W; ++i) {
        if (!active[i]) continue;
        const FieldView& field = field_of_face(scene, scene.surface_of_line(line[i], 0).face());
        float a[3], b[3];
        edge_end(scene, line[i], -1, 0, a);
        edge_end(scene, line[i], -1, 1, b);
        OutlinePoint p;
        if (outline_point(field, viewer(i, field), a, b, u[i], p))
            visit(i, field, p);
        else
            active[i] = 0;
    }
}

// Points of patches of fields' surfaces.
struct PatchSample {
    Vec3 position, normal;
    Float area;  // one over the density of the point, negative where a patch runs back
    PatchPoint point[W];
};

// Places samples on the patches of their lines at (u, v). Samples without a point become inactive.
EG_OUTLINE void place_on_patches(const SceneView& scene, Mask& active, Int line, Float u, Float v,
                                 PatchSample& out) {
    out.position = zero3();
    out.normal = {splat(0.0f), splat(0.0f), splat(1.0f)};
    out.area = splat(0.0f);
    for (int i = 0; i < W; ++i) {
        if (!active[i]) continue;
        const FieldView& field = field_of_face(scene, scene.surface_of_line(line[i], 0).face());
        PatchPoint& p = out.point[i];
        if (!patch_point(field, scene.field_patches[scene.intersection(line[i])], u[i], v[i], p)) {
            active[i] = 0;
            continue;
        }
        set_lane3(out.position, i, p.position);
        set_lane3(out.normal, i, p.normal);
        out.area[i] = p.area;
    }
}

// The normal curvature of the surface along unit tangents, and the length over which rays along them touch
// the surface. Samples whose rays do not stay outside become inactive.
EG_OUTLINE void find_tangent_rays(const SceneView& scene, Mask& active, Int line, const PatchSample& at,
                                  Vec3 along, Float& curvature, Float& contact) {
    curvature = contact = splat(0.0f);
    for (int i = 0; i < W; ++i) {
        if (!active[i]) continue;
        const FieldView& field = field_of_face(scene, scene.surface_of_line(line[i], 0).face());
        float bent = 0.0f, length = 0.0f;
        if (!tangent_ray(field, at.point[i], {along.x[i], along.y[i], along.z[i]}, bent, length))
            active[i] = 0;
        curvature[i] = bent, contact[i] = length;
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
