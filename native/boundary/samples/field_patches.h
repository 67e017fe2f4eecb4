// Samples of points of distance fields' surfaces, and of tangents there.
#pragma once

#include "boundary/samples/outline_samples.h"
#include "sdf/surface_patch.h"

namespace edgegrad::EDGEGRAD_ISA {

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

// The normal curvature of the surface along unit tangents, negative where their rays stay inside, and the
// length over which they touch the surface. Samples whose rays do not stay on one side, or stay inside where
// no light travels, become inactive.
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

// The normal curvature along the tangent at the angle psi between the unit tangents a and b, which are
// orthogonal: middle + along cos(2 psi) + across sin(2 psi). And the samples on fields that light travels in.
EG_OUTLINE void find_curvatures(const SceneView& scene, Mask active, Int line, const PatchSample& at, Vec3 a,
                                Vec3 b, Float& middle, Float& along, Float& across, Mask& inside) {
    middle = along = across = splat(0.0f);
    inside = splat(0);
    for (int i = 0; i < W; ++i) {
        if (!active[i]) continue;
        const FieldView& field = field_of_face(scene, scene.surface_of_line(line[i], 0).face());
        const TangentCurvatures c =
            tangent_curvatures(field, at.point[i], {a.x[i], a.y[i], a.z[i]}, {b.x[i], b.y[i], b.z[i]});
        inside[i] = field.inside ? -1 : 0;
        middle[i] = 0.5f * (c.aa + c.bb), along[i] = 0.5f * (c.aa - c.bb), across[i] = c.ab;
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
