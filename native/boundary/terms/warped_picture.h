// Primary boundary term of distance fields by reparameterisation (Bangaru et al. 2020, Vicini et al. 2022): a
// warp of the picture carries the outlines of fields with it (reparameterisation/picture_warp.h).
//
// Let A be the adjoint of the picture at a place s, f the radiance there and v the warp. Within the regions
// between curves where f jumps, div(A f v) has its values at these curves as its integral. On the outlines v
// is their velocity, so that
//   int over outlines A (f_near - f_far) v . n = int ds [A (f div v + grad f . v) + f v . grad A]
//                                                - the same over all other curves where f jumps.
// Other curves have the velocity -v relative to the warped rays: their terms have it with the motion of the
// camera (reparameterisation/camera_blocks.h). grad f is the derivative of a path by its place in the
// picture, from two sweeps. The filter's derivative, grad A, jumps at the borders of pixels for the box
// filter: f v is then sampled on these borders. Otherwise it is a difference.
#pragma once

#include "boundary/samples/picture_cell.h"
#include "boundary/samples/segment_sampling.h"
#include "path/run.h"
#include "path/start.h"
#include "reparameterisation/ray_search.h"
#include "reparameterisation/warp_task.h"
#include "sdf/field_block.h"
#include "tasks/splats.h"

namespace edgegrad::EDGEGRAD_ISA {

EG_INLINE Mask find_warps(const SceneView& scene, Mask active, const CameraRay& ray, PictureWarp* out) {
    for (int i = 0; i < W; ++i) {
        out[i].count = 0;
        if (active[i]) out[i] = warp_of_ray(scene, picture_ray(scene.camera, ray.origin, ray.direction, i));
        active[i] = out[i].count > 0 ? -1 : 0;
    }
    return active;
}

// Starts a path through a place of the picture.
EG_INLINE int append_camera_path(const SceneView& scene, const ImageTask& task, Workspace& work, int queued,
                                 Mask active, Int path, Float sx, Float sy, Float lens_u, Float lens_v) {
    PathPacket p = first_segment(task.max_depth);
    p.touched = splat(-1);
    p.active = active;
    p.path = path;
    const Closest hit = trace_first(scene, p, sx, sy, lens_u, lens_v, embree::kIncoherent);
    return append_met(work, queued, p, hit, zero3());
}

EG_INLINE void take_radiance(const Workspace& work, int count, float* const (&to)[3]) {
    for (int c = 0; c < 3; ++c)
        __builtin_memcpy(to[c], work.radiance[c], sizeof(float) * static_cast<size_t>(count));
}

// Chooses the samples, and records their paths. Their number is a multiple of the packets' width.
static void warp_record_kernel(const SceneView& scene, const WarpTask& task, Workspace& work) {
    work.vertices->clear();
    const CameraView& camera = scene.camera;
    const BoundaryTask& of = task.samples;
    const WarpSamples& s = task.of;
    const int count = static_cast<int>(of.count);
    SegmentCursor cursor = first_segment(of);
    for (float* channel : work.radiance)
        __builtin_memset(channel, 0, sizeof(float) * static_cast<size_t>(count));
    int queued = 0;
    for (int at = 0; at < count; at += W) {
        const SegmentSample p = sample_edge_segment(scene, of, at, cursor);
        Float sx, sy;
        Float weight = place_in_cell(scene, of, p, sx, sy) * of.scale;
        const auto [lens_u, lens_v] = lens_numbers(camera, p.random);
        const Float choice = sobol_pair(p.random, vertex_pair(splat(1 << 20), kVertexChoice)).u;
        PictureWarp warp[W];
        const Mask within = find_warps(scene, p.active, camera_ray(camera, sx, sy, lens_u, lens_v), warp);
        if (any(within))
            queued = append_camera_path(scene, task.paths, work, queued, within, lane_index() + at, sx, sy,
                                        lens_u, lens_v);
        const Mask vertical = choice < 0.5f;
        for (int i = 0; i < W && at + i < count; ++i) {
            s.warp[at + i] = warp[i];
            s.weight[at + i] = p.active[i] ? weight[i] : 0.0f;
            s.axis[at + i] = vertical[i] ? 0 : 1;
            s.border[0][at + i] = sx[i], s.border[1][at + i] = sy[i];
        }
        store(work.camera.x + at, sx), store(work.camera.y + at, sy);
        store(work.camera.lens_u + at, lens_u), store(work.camera.lens_v + at, lens_v);
    }
    if (queued > 0) run_paths(scene, task.paths, work, queued);
    take_radiance(work, count, s.value);
}

// Without a box filter, the filter's derivative uses the samples themselves. With it, moves each to the
// border of its pixel, and traces a path there.
static void warp_borders_kernel(const SceneView& scene, const WarpTask& task, Workspace& work) {
    const CameraView& camera = scene.camera;
    const WarpSamples& s = task.of;
    const int count = static_cast<int>(task.samples.count);
    for (float* channel : work.radiance)
        __builtin_memset(channel, 0, sizeof(float) * static_cast<size_t>(count));
    int queued = 0;
    for (int at = 0; at < count; at += W) {
        Float place[2] = {load(work.camera.x + at), load(work.camera.y + at)};
        Mask active = first_lanes(count - at);
        for (int i = 0; i < W && at + i < count; ++i) {
            active[i] &= s.weight[at + i] != 0.0f ? -1 : 0;
            float& across = s.border[s.axis[at + i]][at + i];
            across = __builtin_floorf(across + 0.5f);
            place[s.axis[at + i]][i] = across;
        }
        const Float lens_u = load(work.camera.lens_u + at), lens_v = load(work.camera.lens_v + at);
        PictureWarp warp[W];
        const Mask within =
            find_warps(scene, active, camera_ray(camera, place[0], place[1], lens_u, lens_v), warp);
        for (int i = 0; i < W && at + i < count; ++i) s.border_warp[at + i] = warp[i];
        if (any(within))
            queued = append_camera_path(scene, task.paths, work, queued, within, lane_index() + at, place[0],
                                        place[1], lens_u, lens_v);
    }
    if (queued > 0) run_paths(scene, task.paths, work, queued);
    take_radiance(work, count, s.border_value);
}

// One sample's part as a linear form of the fields: colors that multiply dphi and grad dphi.
struct WarpSampleValue {
    const WarpTask& task;
    int i;

    bool active() const { return task.of.weight[i] != 0.0f; }
    float light(float* const (&value)[3], int c) const { return value[c][i] - task.control[c]; }
    // At the sample: the factors of dphi and of beta . grad dphi, without the weight.
    float by_change(const WarpPart& p, int c) const {
        const WarpSamples& s = task.of;
        return light(s.value, c) * p.spread + s.by_place[0][c][i] * p.step[0] +
               s.by_place[1][c][i] * p.step[1];
    }
    // On a border of the picture only half as many samples are moved to it.
    float border_weight(const CameraView& camera) const {
        const WarpSamples& s = task.of;
        const float at = s.border[s.axis[i]][i];
        const bool ends = s.border_step >= 0.1f &&
                          (at <= 0.0f || at >= static_cast<float>(s.axis[i] ? camera.height : camera.width));
        return s.weight[i] * s.border_weight * (ends ? 2.0f : 1.0f);
    }
    // The size of the sample, without motion and adjoint.
    float size(const CameraView& camera) const {
        const WarpSamples& s = task.of;
        float sum = 0.0f;
        for (int k = 0; k < s.warp[i].count; ++k) {
            const WarpPart& p = s.warp[i].part[k];
            for (int c = 0; c < 3; ++c) sum += s.weight[i] * p.slope * __builtin_fabsf(by_change(p, c));
        }
        const float border = border_weight(camera);
        for (int k = 0; k < s.border_warp[i].count; ++k) {
            const WarpPart& p = s.border_warp[i].part[k];
            for (int c = 0; c < 3; ++c)
                sum += border * p.slope * __builtin_fabsf(light(s.border_value, c) * p.step[s.axis[i]]);
        }
        return sum;
    }
};

// Drops samples of infinite size, and writes the sizes of a first pass.
EG_INLINE void weigh_warp(const SceneView& scene, const WarpTask& task) {
    const BoundaryTask& of = task.samples;
    for (int i = 0; i < static_cast<int>(of.count); ++i) {
        const float size = task.of.weight[i] != 0.0f ? WarpSampleValue{task, i}.size(scene.camera) : 0.0f;
        const bool finite = size < kLargestSample;
        if (!finite) {
            task.of.weight[i] = 0.0f;
            if (of.dropped->count++ == 0) of.dropped->first = of.first + i, of.dropped->place = -1;
        }
        if (of.score) of.score[of.first + i] = finite ? size : 0.0f;
    }
}

static void warp_forward_kernel(const SceneView& scene, const WarpTask& task, Workspace& work,
                                const DerivativeView& tangent, Splats& splats) {
    weigh_warp(scene, task);
    const WarpSamples& s = task.of;
    for (int i = 0; i < static_cast<int>(task.samples.count); ++i) {
        const int64_t at = static_cast<int64_t>(kWarpSplats) * i;
        for (int k = 0; k < kWarpSplats; ++k) splats.x[at + k] = kNowhere;
        const WarpSampleValue sample{task, i};
        if (!sample.active()) continue;
        const auto put = [&](int k, float x, float y, const float (&value)[3]) {
            splats.x[at + k] = x, splats.y[at + k] = y;
            for (int c = 0; c < 3; ++c) splats.value[c][at + k] = value[c];
        };
        float value[3] = {}, border[3] = {};
        for (int k = 0; k < s.warp[i].count; ++k) {
            const WarpPart& p = s.warp[i].part[k];
            if (!tangent.fields.moves(*p.field)) continue;
            float change, slope[3];
            field_forward(*p.field, tangent.fields, field_jet(*p.field, p.point), change, slope);
            const float turn = p.along[0] * slope[0] + p.along[1] * slope[1] + p.along[2] * slope[2];
            for (int c = 0; c < 3; ++c)
                value[c] += s.weight[i] * (sample.by_change(p, c) * change + sample.light(s.value, c) * turn);
        }
        put(0, work.camera.x[i], work.camera.y[i], value);
        const int axis = s.axis[i];
        const float moved = warp_forward(s.border_warp[i], tangent.fields, axis == 0, axis == 1);
        const float weight = sample.border_weight(scene.camera) * moved;
        for (int side = 0; side < 2; ++side) {
            for (int c = 0; c < 3; ++c)
                border[c] = (side ? weight : -weight) * sample.light(s.border_value, c);
            const float step = side ? s.border_step : -s.border_step;
            put(1 + side, s.border[0][i] + (axis == 0 ? step : 0.0f),
                s.border[1][i] + (axis == 1 ? step : 0.0f), border);
        }
    }
}

static void warp_backward_kernel(const SceneView& scene, const WarpTask& task, Workspace& work,
                                 const float* adjoint, DerivativeView& gradient) {
    weigh_warp(scene, task);
    const WarpSamples& s = task.of;
    const int count = static_cast<int>(task.samples.count);
    for (int at = 0; at < count; at += W) {
        const Mask active = first_lanes(count - at);
        Float x = splat(0.0f), y = x, by_x = x, by_y = x;
        for (int i = 0; i < W && at + i < count; ++i) {
            x[i] = s.border[0][at + i], y[i] = s.border[1][at + i];
            (s.axis[at + i] ? by_y : by_x)[i] = s.border_step;
        }
        const Vec3 here =
            adjoint_at(scene.camera, active, load(work.camera.x + at), load(work.camera.y + at), adjoint);
        const Vec3 across = adjoint_at(scene.camera, active, x + by_x, y + by_y, adjoint) -
                            adjoint_at(scene.camera, active, x - by_x, y - by_y, adjoint);
        for (int i = 0; i < W && at + i < count; ++i) {
            const WarpSampleValue sample{task, at + i};
            if (!sample.active()) continue;
            const float a[3] = {here.x[i], here.y[i], here.z[i]},
                        d[3] = {across.x[i], across.y[i], across.z[i]};
            for (int k = 0; k < s.warp[at + i].count; ++k) {
                const WarpPart& p = s.warp[at + i].part[k];
                if (!gradient.fields.moves(*p.field)) continue;
                float alpha = 0.0f, light = 0.0f;
                for (int c = 0; c < 3; ++c) {
                    alpha += a[c] * sample.by_change(p, c);
                    light += a[c] * sample.light(s.value, c);
                }
                alpha *= s.weight[at + i], light *= s.weight[at + i];
                field_backward(*p.field, gradient.fields, field_jet(*p.field, p.point), alpha,
                               {light * p.along[0], light * p.along[1], light * p.along[2]});
            }
            float border = 0.0f;
            for (int c = 0; c < 3; ++c) border += d[c] * sample.light(s.border_value, c);
            border *= sample.border_weight(scene.camera);
            const int axis = s.axis[at + i];
            if (border != 0.0f)
                warp_backward(s.border_warp[at + i], gradient.fields, axis == 0 ? border : 0.0f,
                              axis == 1 ? border : 0.0f);
        }
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
