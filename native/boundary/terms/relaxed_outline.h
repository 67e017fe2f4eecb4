// Primary boundary term of distance fields by relaxed boundaries (Wang et al. 2024): the outline of a field
// is spread over a band of the picture. With the minimum phi* of a field along a camera ray
// (reparameterisation/near_miss.h), its outline phi* = 0 is where the radiance jumps from L_near on the
// surface to L_far behind it, and
//   dI = int ds delta(phi*) (L_near - L_far) (-dphi).
// Here delta is 1/(2 w) for |phi*| < w, on both sides of the outline. L_near is the radiance of the surface
// nearest to the minimum and L_far that of what is behind it. This is biased: the picture of the derivative
// is blurred by the width of the band, and all level sets in the band count as the outline.
#pragma once

#include "boundary/samples/picture_cell.h"
#include "boundary/terms/field_outline.h"
#include "reparameterisation/ray_search.h"

namespace edgegrad::EDGEGRAD_ISA {

// The point of the surface near a near miss, in grid coordinates.
inline void pull_to_surface(const FieldView& f, double (&grid)[3], SplineJet& jet) {
    constexpr int kSteps = 4;
    for (int k = 0; k < kSteps; ++k) {
        const auto& g = jet.gradient;
        const double step = jet.value / __builtin_fmax(g[0] * g[0] + g[1] * g[1] + g[2] * g[2], 1e-300);
        for (int a = 0; a < 3; ++a) grid[a] -= step * g[a];
        jet = spline_jet(f, grid);
    }
}

// Sets a lane to one of the near misses of its ray: EdgeSample::instance is the face that stands for its
// field, and the outline's point that of the surface nearest to the minimum.
inline void set_near_miss(const SceneView& scene, const PictureRay& ray, NearMiss m, int i, EdgeSample& s,
                          OutlineSample& out, Float& part) {
    const FieldView& f = *m.field;
    s.instance[i] = scene.first_field_face + static_cast<int32_t>(m.field - scene.fields);
    float position[3], normal[3];
    double slope = 0.0, length = 0.0;
    double point[3];
    f.place_in_world(m.grid, point);
    for (int c = 0; c < 3; ++c) {
        position[c] = static_cast<float>(point[c]);
        length += ray.direction[c] * ray.direction[c];
    }
    set_lane3(s.point, i, position);
    const auto normal_of = [&](const SplineJet& jet) {
        double g[3];
        f.gradient_in_world(jet.gradient, g);
        slope = __builtin_sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
        for (int c = 0; c < 3; ++c) normal[c] = static_cast<float>(g[c] / __builtin_fmax(slope, 1e-150));
    };
    // The velocity of the surface is -dphi/|g| along its normal
    normal_of(m.jet);
    set_lane3(s.normal, i, normal);
    part[i] = static_cast<float>(0.5 * slope / m.width);
    // The ray is in the surface over this length before and behind the point
    constexpr double kSlack = 1.5;
    const double within = m.jet.value < 0.0 ? __builtin_sqrt(-2.0 * m.jet.value / m.curvature) : 0.0;
    out.contact[i] = static_cast<float>(kSlack * within * __builtin_sqrt(length));
    pull_to_surface(f, m.grid, m.jet);
    normal_of(m.jet);
    set_lane3(out.normal, i, normal);
    set_place(f, m.grid, i, out.hit.b1, out.hit.b2);
}

inline EG_NOINLINE EdgeSample sample_band(const SceneView& scene, const BoundaryTask& task, int64_t at,
                                          SegmentCursor& cursor, OutlineSample& out) {
    const SegmentSample p = sample_edge_segment(scene, task, at, cursor);
    const CameraView& camera = scene.camera;
    EdgeSample s;
    s.active = p.active;
    s.edge = splat(-1);
    s.instance = splat(0);
    s.intersection = splat(0);
    s.random = p.random;
    s.mask = splat(1 << kCameraRay);
    s.u = splat(0.0f);
    s.end = s.tangent = s.point = zero3();
    s.normal = out.normal = {splat(0.0f), splat(0.0f), splat(1.0f)};
    out.contact = splat(0.0f);
    out.hit.b1 = out.hit.b2 = out.hit.distance = splat(0.0f);
    Float sx, sy, part = splat(0.0f);
    s.weight = place_in_cell(scene, task, p, sx, sy) * task.scale;
    const auto [lens_u, lens_v] = lens_numbers(camera, p.random);
    const Float choice = sobol_pair(p.random, vertex_pair(splat(1 << 20), kVertexChoice)).u;
    const CameraRay ray = camera_ray(camera, sx, sy, lens_u, lens_v);
    for (int i = 0; i < W; ++i) {
        if (!s.active[i]) continue;
        const PictureRay line = picture_ray(camera, ray.origin, ray.direction, i);
        NearMiss misses[kMostNearMisses];
        const int count = find_near_misses(scene, line, misses);
        s.active[i] = count > 0 ? -1 : 0;
        if (count == 0) continue;
        const int k = static_cast<int>(choice[i] * static_cast<float>(count));
        set_near_miss(scene, line, misses[k < count ? k : count - 1], i, s, out, part);
        part[i] *= static_cast<float>(count);
    }
    s.weight = s.weight * part;
    s.view = project(camera, s.point, lens_of(camera, p.random));
    s.view.sx = sx, s.view.sy = sy;
    s.active &= s.view.active & (s.view.distance > s.view.near) & (s.view.distance < s.view.far);
    out.hit.hit = s.active;
    out.hit.face = select(s.active, s.instance, splat(0));
    out.hit.mesh = splat(0);
    out.hit.instance = splat(-1);
    out.grazing = s.view.direction - out.normal * dot(s.view.direction, out.normal);
    out.minus = splat(-1);
    return s;
}

struct FieldBands : OutlineSides<sample_band> {
    template <typename Mode>
    EG_INLINE static void blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                                 const TracedSample& traced, Vec3 color) {
        const EdgeSample& s = traced.sample;
        view_blocks(mode, scene, motion, s, color);
        if (motion.fields.any())
            mode.field(s.active, select(s.active, s.instance, splat(scene.first_field_face)), s.point,
                       s.normal * s.weight, color);
    }
};

}  // namespace edgegrad::EDGEGRAD_ISA
