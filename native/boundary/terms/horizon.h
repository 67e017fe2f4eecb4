// Horizon term: light cut off by the plane of the face that receives it (derivations, H).
//
// A face F of a smooth mesh is shaded with a normal n_s other than its own normal n. Light in F's plane then
// still contributes, while light from below does not. At a point x of F the radiance
//   L = int_(n . w > 0) f |n_s . w| L(w) dw
// has a domain bounded by the great circle n . w = 0. With y the point from which light arrives along w, at
// the distance r, and m_F the velocity of F's points, extended affinely over its plane,
//   dI = int dphi f |n_s . w| L(w) n . (dy - m_F(y))/r,
// where phi is the angle about n. x's own motion within the plane drops out. m_F(y)/r is evaluated as
// m_F(x + w) - m_F(x) + m_F(x)/r. For light at infinity dy/r is the velocity of its direction. For light that
// is blended to a fixed direction with the weight b (scene/contact.h), 1/r becomes (1 - b)/r. For surfaces
// that transmit light the jump is f above the plane minus f below it. On flat faces f |n_s . w| vanishes at
// the horizon. Meshes with a terminator offset receive lights and the environment's image from below as well
// (shading/receiving_normal.h). Their horizons cut off scattered light and constant environments alone.
//
// x is a vertex of a camera path (boundary/segment/camera_subpath.h). For lights, w is uniform on the arc in
// which F's plane intersects a sampled light (shading/lights/light_arc.h). For the environment and for
// surfaces, w is sampled by plane_direction.
#pragma once

#include "boundary/segment/camera_connection.h"
#include "boundary/segment/camera_subpath.h"
#include "boundary/segment/light_source.h"
#include "boundary/segment/scattering_chain.h"
#include "boundary/segment/segment.h"
#include "boundary/terms/horizon_cut.h"
#include "path/run.h"
#include "shading/lights/light_arc.h"
#include "tasks/horizon_task.h"
#include "tasks/image_task.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// Lanes that also receive emitter samples from below F's plane (receiving_normal), so that it cuts off none.
EG_INLINE Mask receives_below(const SceneView& scene, const ScatteringPoint& s) {
    return scene.any_terminator ? gather(scene.mesh_terminator, s.x.mesh) > 0.0f : splat(0);
}

// Samples the light of the scene's lights in F's plane.
EG_OUTLINE void cut_lights(const SceneView& scene, const HorizonTask& task, const DerivativeView& motion,
                           const PathPacket& p, Vec3 followed, const ScatteringPoint& s,
                           const HorizonSide& side, const PathIndex& random, Mask chained, Vec3 first,
                           HorizonCut& cut) {
    // Sample an arc of a light
    LightSample light = sample_light_arc(scene, p.active, s.x.position, s.x.normal, s.x.face,
                                         sobol_pair(random, kPairLight).u);
    light.active &= shines_on(scene, light.row, s.x.mesh, bounces_before(p)) & ~receives_below(scene, s);
    cut.active = light.active;
    cut.towards = light.w;
    cut.distance = light.r;
    // Light of a fixed direction is cut off like the environment's.
    const Mask fixed = holds_direction(scene, light.active, light.face, s.x.material);
    cut.distance = select(fixed, splat(__builtin_inff()), cut.distance);
    cut.y.face = select(light.active & ~fixed, light.face, splat(-1)), cut.y.b1 = light.b1;
    cut.y.b2 = light.b2;
    cut.y.row = select(light.active, light.row, splat(-1)), cut.y.kind = light.kind;
    cut.material_weight = 1.0f - fixed_direction_weight(scene, cut.active, p.segment - 1, s.x, cut.y);
    // Skip samples that do not move
    const Mask turns = cut.active & (light.row >= 0) & turns_with_point(light.kind);
    Mask moves = face_point_moves(scene, motion, cut.active, cut.face, cut.instance) |
                 face_point_moves(scene, motion, cut.active & (cut.y.face >= 0), cut.y.face, cut.y.instance);
    if (motion.lights_requested) moves |= cut.active & (cut.y.row >= 0);
    if (rays_move(motion)) moves |= turns;
    moves |= turns & chained;
    cut.active &= moves;
    if (!any(cut.active)) return;

    // Evaluate the BSDF and the light
    const Int kinds = light.visible_to;
    const Vec3 f = brought_at_horizon(scene, s, cut.active, side, light.w, kinds, p.throughput, followed,
                                      followed_for(scene, light.active, light.row));
    cut.active &= size_of(f) > 0.0f;
    light.active = cut.active;
    look_up_emission(scene, light);
    cut.color = f * light.radiance * light.geometry;
    cut.active &= size_of(cut.color) > 0.0f;
    if (!any(cut.active)) return;
    const Vec3 start = leave_surface(s.x, side.normal) + terminator_lift(scene, s.x, s.point.normal, light.w);
    const Vec3 direction = select(light.distant, light.w, light.end - start);
    const Float far = select(light.distant, splat(__builtin_inff()), 0.99999f);
    const Vec3 through =
        transmittance(scene, cut.active & light.casts_shadow, start, direction, far, {light.blockers});
    cut.color = select(light.casts_shadow, cut.color * through, cut.color);
    const Mask seen = cut.active & turns & ((p.segment == 1) | chained);
    if (any(seen)) {
        cut.view = place_in_picture(scene, seen, select(chained, first, s.x.position),
                                    path_index(task.image, p.path));
        cut.screen_form = seen & ~chained & cut.view.active;
    }
}

// The task's samples as paths that start at the surfaces met by their rays.
EG_INLINE ImageTask beyond_paths(const ImageTask& task) {
    ImageTask paths = task;
    paths.seed = hash(task.seed ^ 0x5be0cd19u);
    return paths;
}

// Samples the light of the environment, and the light that surfaces scatter, in F's plane. Appends the paths
// that estimate the latter to the queue of length `queued`, and returns the new length.
EG_OUTLINE int cut_beyond(const SceneView& scene, const HorizonTask& task, const DerivativeView& motion,
                          const PathPacket& p, Vec3 followed, const ScatteringPoint& s,
                          const HorizonSide& side, const PathIndex& random, Workspace& work, int queued,
                          HorizonCut& cut) {
    const bool environment = task.lights && scene.has_environment;
    const Mask further = p.active & (p.segment + 1 < task.image.max_depth);
    if (!environment && !(task.surfaces && any(further))) return queued;
    // Trace a ray in the plane
    Float density;
    const Vec3 w = plane_direction(s, sobol_pair(random, kPairEnvironment).u, density);
    const Mask active = p.active & (density > 1e-6f) & (environment ? splat(-1) : further);
    const ImageTask paths = beyond_paths(task.image);
    const LightSource y = meet_source(scene, active, leave_surface(s.x, side.normal), w, ignore_nothing(),
                                      path_index(paths, p.path), task.image.limits.transparent);
    // Skip samples that do not move
    Mask met = splat(0), open = splat(0);
    if (task.surfaces) met = y.hit.hit & further;
    if (environment) open = y.escapes;
    if (scene.environment_image.sampled) open &= ~receives_below(scene, s);
    Mask moves = face_point_moves(scene, motion, met | open, cut.face, cut.instance) |
                 face_point_moves(scene, motion, met, y.hit.face, y.hit.instance);
    if (motion.rotation_requested && scene.environment_image.pixels) moves |= open;
    met &= moves;
    open &= moves;
    if (!any(met | open)) return queued;
    // Evaluate the BSDF
    const Int kinds = select(open, splat(scene.environment_mask), splat(kScatteredRays));
    const Vec3 f = brought_at_horizon(scene, s, met | open, side, w, kinds, p.throughput, followed,
                                      splat(scene.followed_alpha));
    cut.active = (met | open) & (size_of(f) > 0.0f);
    cut.towards = w;
    cut.distance = select(met, y.distance, splat(__builtin_inff()));
    cut.y.face = select(met, y.hit.face, splat(-1)), cut.y.instance = y.hit.instance;
    cut.y.b1 = y.hit.b1, cut.y.b2 = y.hit.b2;
    cut.material_weight = 1.0f - fixed_direction_weight(scene, met, p.segment - 1, s.x, cut.y);
    cut.y.environment = open & turns_with_environment(scene);
    cut.color = f * (1.0f / max(density, 1e-30f));
    if (any(open))
        cut.color = select(open, cut.color * y.through * environment_radiance(scene, w), cut.color);
    met &= cut.active;
    if (!any(met)) return queued;
    // Choose the kind of the bounce at x by the BSDF, and test the bounce limits.
    Int kind = splat(kDiffuseRay), bounces = p.bounces & 0xffffff;
    if (kinds_matter(scene, task.image.limits, task.image.max_depth)) {
        const Float chance = sobol_pair(random, kPairStrategy).v;
        const Vec3 soft = scattered_at_horizon(scene, s, met, side, w, splat(1 << kDiffuseRay));
        const Vec3 all = scattered_at_horizon(scene, s, met, side, w, splat(kScatteredRays));
        kind = bounce_kind(s.x, side.normal, all * side.weight, soft * side.weight, chance);
        met &= ~next_is_final(task.image, p, kind);
        cut.active &= met | open;
    }
    bounces = add_bounce(bounces, met, kind);
    return append_scattering(work, queued, met, p.path, leave_surface(s.x, side.normal), w, y.hit, y.aside,
                             y.through, y.passed, p.segment + 1, bounces, kind);
}

// Samples a packet of paths from `at` on. Returns the new length of the queue of paths behind them.
EG_OUTLINE int sample_horizon(const SceneView& scene, const HorizonTask& task, const DerivativeView& motion,
                              int at, int count, Workspace& work, int queued, HorizonSample& out) {
    // Follow the camera paths to x
    PathPacket p = load_paths(work.paths, at, count);
    const Int face = load(work.hits.face + at);
    Closest hit = load_hits(work.hits, at, p.active & (face >= 0));
    const PathIndex random = path_index(task.image, p.path);
    out.light.active = out.beyond.active = splat(0);
    Float probability;
    const Int target = pick_vertex(random, task.image.max_depth - 1, probability);
    WalkParts parts;
    Vec3 first = zero3();
    const bool chains =
        scene.mesh_contact && task.lights && (scene.lights.kinds & kTurningLights) && any(target > 1);
    if (scene.mesh_contact) begin_fixed_direction_chain(scene, p.active, target - 1, out.fixed);
    if (chains) {
        const PlacedTriangle t = placed_triangle(scene, hit.hit, face, hit.instance);
        first = hit_position(scene, hit.hit, hit, t);
    }
    walk_camera_paths(scene, task.image, p, hit, target, {}, chains ? &out.fixed : nullptr, &parts);
    if (!any(p.active)) return queued;
    // Keep surfaces whose shading normal differs from the face's
    ScatteringPoint s = scattering_point(scene, task.image, p, p.active, hit);
    s.by_face = true;
    const Vec3 leans = cross(s.normal, s.x.normal);
    p.active &= s.x.active & (dot(leans, leans) > 1e-12f);
    if (!any(p.active)) return queued;
    p.throughput = p.throughput * (s.shader.scale / probability);
    const Vec3 followed = parts.followed * (s.shader.scale / probability);
    // Sample lights, the environment and surfaces
    out.light = out.beyond = empty_cut(s.x);
    const HorizonSide side = pick_side(s, random);
    if (task.lights && scene.lights.count > 0)
        cut_lights(scene, task, motion, p, followed, s, side, random,
                   chains ? out.fixed.length > 0 : splat(0), first, out.light);
    queued = cut_beyond(scene, task, motion, p, followed, s, side, random, work, queued, out.beyond);
    if (any(out.light.active)) keep_finite(task, p, out.light);
    if (any(out.beyond.active)) keep_finite(task, p, out.beyond);
    return queued;
}

// Samples all of the task's paths.
EG_OUTLINE HorizonSample* sample_horizons(const SceneView& scene, const HorizonTask& task,
                                          const DerivativeView& motion, Workspace& work) {
    const int count = start_paths(scene, task.image, work);
    const size_t packets = static_cast<size_t>((count + W - 1) / W);
    auto* samples = static_cast<HorizonSample*>(work.segments->grow(packets * sizeof(HorizonSample), 0));
    int queued = 0;
    for (int at = 0; at < count; at += W)
        queued = sample_horizon(scene, task, motion, at, count, work, queued, samples[at / W]);
    run_appended(scene, beyond_paths(task.image), work, queued, count);
    for (int at = 0; at < count; at += W) {
        HorizonCut& cut = samples[at / W].beyond;
        if (!any(cut.active)) continue;
        Vec3 light;
        load3(light, work.radiance, at);
        cut.color = select(cut.y.face >= 0, cut.color * light, cut.color);
    }
    return samples;
}

// Adds n . (dy - m_F(y))/r, times the color, for the requested parameters.
template <typename Mode>
EG_INLINE void horizon_blocks(Mode& mode, const SceneView& scene, const DerivativeView& motion,
                              const HorizonCut& cut, const FixedDirectionChain& fixed) {
    if (!any(cut.active)) return;
    const Vec3 n = cut.normal;
    const Mask near = cut.distance < __builtin_inff();
    const Float inverse = select(near, cut.material_weight / max(cut.distance, 1e-30f), splat(0.0f));
    face_turn_blocks(mode, scene, motion, cut.active, cut.face, cut.instance, cut.b1, cut.b2, cut.towards, -n,
                     cut.color);
    face_point_blocks(mode, scene, motion, cut.active, cut.face, cut.instance, cut.b1, cut.b2, n * -inverse,
                      cut.color);
    // The far end
    const Mask on_face = cut.active & (cut.y.face >= 0);
    if (any(on_face))
        surface_point_blocks(mode, scene, motion, on_face, cut.y.face, cut.y.instance, cut.y.b1, cut.y.b2,
                             cut.position + cut.towards * select(on_face, cut.distance, splat(0.0f)),
                             n * inverse, cut.color);
    const Vec3 g = select(is_distant(cut.y), n, n * inverse);
    const Vec3 from = far_end_blocks(mode, scene, motion, cut.active, cut.y, cut.position, cut.towards,
                                     cut.distance, g, cut.color);
    // For a light that faces x: x slides along its pixel's ray, or moves with F.
    if (!any(cut.active & (largest_component(from) > 0.0f))) return;
    const Vec3 d = select(cut.screen_form, cut.view.across_of, n);
    const Float nd = dot(n, d);
    const Vec3 slide = n * (dot(from, d) / select(abs(nd) > 1e-12f, nd, 1e-12f));
    Vec3 to_face = select(cut.screen_form, slide, from);
    if (scene.mesh_contact && any(cut.active & (cut.y.row >= 0) & (fixed.length > 0))) {
        SurfacePoint x{};
        x.normal = n;
        to_face = fixed_direction_blocks(mode, scene, motion, cut.active & (cut.y.row >= 0), fixed, x,
                                         cut.view, from, to_face, cut.color);
    }
    face_point_blocks(mode, scene, motion, cut.active, cut.face, cut.instance, cut.b1, cut.b2, to_face,
                      cut.color);
    const Mask seen = cut.active & cut.screen_form;
    if (any(seen)) camera_blocks(mode, scene, motion, seen, cut.view, from - slide, cut.color);
}

// Writes the values of the task's paths to work.radiance.
static void horizon_forward_kernel(const SceneView& scene, const HorizonTask& task, Workspace& work,
                                   const DerivativeView& tangent) {
    const HorizonSample* samples = sample_horizons(scene, task, tangent, work);
    const int count = task.image.pixel_count * task.image.samples;
    for (int at = 0; at < count; at += W) {
        Forward mode{scene, tangent};
        horizon_blocks(mode, scene, tangent, samples[at / W].light, samples[at / W].fixed);
        horizon_blocks(mode, scene, tangent, samples[at / W].beyond, samples[at / W].fixed);
        store3(work.radiance, at, mode.value);
    }
}

static void horizon_backward_kernel(const SceneView& scene, const HorizonTask& task, Workspace& work,
                                    const float* adjoint, DerivativeView& gradient) {
    const HorizonSample* samples = sample_horizons(scene, task, gradient, work);
    const int count = task.image.pixel_count * task.image.samples;
    for (int at = 0; at < count; at += W) {
        const HorizonSample& s = samples[at / W];
        if (!any(s.light.active | s.beyond.active)) continue;
        const Int path = select(first_lanes(count - at), lane_index() + at, splat(0));
        const Int pixel = path_index(task.image, path).pixel + task.image.first_pixel;
        Backward mode{scene, gradient, gather3(adjoint, pixel) * splat(task.image.weight)};
        horizon_blocks(mode, scene, gradient, s.light, s.fixed);
        horizon_blocks(mode, scene, gradient, s.beyond, s.fixed);
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
