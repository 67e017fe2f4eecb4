// Parts of the shading code that read the scene, evaluated one packet at a time. Tests take their
// derivatives.
#pragma once

#include "adjoint/block_probes.h"
#include "path/camera_rays.h"
#include "shading/lights/environment.h"
#include "shading/lights/light_rows.h"
#include "shading/surface_shader.h"
#include "tasks/probe_tasks.h"

namespace edgegrad::EDGEGRAD_ISA {

// Position, normal and smooth normal at the barycentrics a.xy, seen along b.
EG_INLINE void probe_surface(const SceneView& scene, SceneProbePacket& p) {
    const SurfacePoint x = surface_point(scene, p.active, p.index, p.a.x, p.a.y, p.b, p.instance);
    p.put(0, x.position);
    p.put(3, x.normal);
    p.put(6, smooth_normal(scene, x));
}

// The normal of a normal map with the colour b and the strength a.z, and the tangent of anisotropy.
EG_INLINE void probe_bent_normal(const SceneView& scene, SceneProbePacket& p) {
    const Vec3 along = {splat(0.2f), splat(0.3f), splat(-0.93f)};
    const SurfacePoint x = surface_point(scene, p.active, p.index, p.a.x, p.a.y, along, p.instance);
    const TexturePoint point = texture_point(scene, x, -along, splat(0));
    p.put(0, mapped_normal(scene, p.active, uv_map(scene.textures, splat(0)), point, p.b, p.a.z));
    p.put(3, surface_tangent(scene, p.active, splat(0), point, point.normal));
}

// The ray through the picture point a.xy and the lens point b.xy.
EG_INLINE void probe_camera(const SceneView& scene, SceneProbePacket& p) {
    const CameraRay ray = camera_ray(scene.camera, p.a.x, p.a.y, p.b.x, p.b.y);
    p.put(0, ray.origin);
    p.put(3, ray.direction);
}

// Radiance of a light of the table in direction -b, and the shape of an area light seen from a.
EG_INLINE void probe_light(const SceneView& scene, SceneProbePacket& p) {
    const LightRow l = gather_light(scene.lights, p.index);
    const AreaShape shape = area_shape(l, p.a);
    p.put(0, l.radiance * light_factor(l, p.b, sqrt(dot(shape.center, shape.center))));
    p.put(3, shape.center);
    p.put(6, shape.axis_x + shape.axis_y);
}

// The radiance of the environment along b.
EG_INLINE void probe_environment(const SceneView& scene, SceneProbePacket& p) {
    p.put(0, environment_radiance(scene, p.b));
}

// By SceneProbeKind.
constexpr void (*kSceneProbes[])(const SceneView&, SceneProbePacket&) = {
    probe_surface, probe_bent_normal, probe_camera,   probe_environment,
    probe_light,   probe_met_point,   probe_segments, probe_reflection};

EG_INLINE SceneProbePacket run_scene_probe(const SceneView& scene, const SceneProbe& probe, int64_t first) {
    SceneProbePacket p;
    p.active = first_lanes(static_cast<int>(probe.count - first < W ? probe.count - first : W));
    const Int at = select(p.active, lane_index(), splat(0));
    p.index = gather(probe.index + first, at);
    p.instance = gather(probe.instance + first, at);
    p.a = gather3(probe.a + 3 * first, at);
    p.b = gather3(probe.b + 3 * first, at);
    for (Float& v : p.output) v = splat(0.0f);
    kSceneProbes[probe.kind](scene, p);
    return p;
}

}  // namespace edgegrad::EDGEGRAD_ISA
