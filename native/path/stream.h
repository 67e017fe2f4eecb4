// The stream of camera paths: a chunk of pixels times samples is traced in packets, the paths that
// hit a surface are compacted into a queue, and the queue is shaded in full packets.
#pragma once

#include "kernels.h"
#include "path/camera_rays.h"
#include "shading/direct_light.h"

namespace edgegrad::EDGEGRAD_ISA {

// Random stream of a pixel; the sampler scrambles and shuffles by it.
EG_INLINE UInt pixel_stream(uint32_t seed, UInt pixel) {
    return hash(pixel ^ splat(hash(seed + 0x9e3779b9u)));
}

// a / b for small non-negative a (< 2^20), exactly: vector units have no integer division.
EG_INLINE Int quotient(Int a, int b) { return to_int((to_float(a) + 0.5f) * (1.0f / static_cast<float>(b))); }

// Path p of a task is sample p % samples of pixel p / samples, counted from the task's first ones.
struct PathIndex {
    Int pixel;  // relative to the task's first pixel
    UInt sample;
    UInt stream;  // random numbers of the pixel
};

EG_INLINE PathIndex path_index(const ImageTask& task, Int path) {
    PathIndex index;
    index.pixel = quotient(path, task.samples);
    index.sample = bits(path - index.pixel * task.samples + task.first_sample);
    if (task.one_stream) {
        index.stream = splat(hash(task.seed));
        return index;
    }
    // A pixel's random numbers are those that it has in the full picture: a crop is a part of it.
    Int number = index.pixel + (task.first_pixel + task.skipped_all);
    if (task.skipped_row > 0)
        number = number + (quotient(index.pixel + task.column, task.width) + task.row) * task.skipped_row;
    index.stream = pixel_stream(task.seed, bits(number));
    return index;
}

// Traces all paths of the task. Those that hit a surface go to the workspace's queue (their number
// is returned), the rest sees the environment.
EG_INLINE int trace_camera_paths(const SceneView& scene, const ImageTask& task, Vec3 background,
                                 Workspace& work) {
    const CameraView& camera = scene.camera;
    const int paths = task.pixel_count * task.samples;
    int queued = 0;
    for (int at = 0; at < paths; at += W) {
        const Mask active = first_lanes(paths - at);
        const Int path = lane_index() + at;
        const PathIndex index = path_index(task, path);
        Float u, v;
        sobol_pair(index.stream, index.sample, kPairPixel, u, v);
        const Int rows = quotient(index.pixel + task.column, camera.width);
        const Float sx = to_float(index.pixel + task.column - rows * camera.width) + u;
        const Float sy = to_float(rows + task.row) + v;
        const Vec3 direction = camera_direction(camera, sx, sy);
        const Closest closest =
            intersect(scene, active, splat3(camera.position), direction, splat(camera.clip_start),
                      splat(camera.clip_end), ignore_nothing(), embree::kCoherent);
        store(work.radiance[0] + at, background.x);
        store(work.radiance[1] + at, background.y);
        store(work.radiance[2] + at, background.z);
        append(work.path, queued, closest.hit, path);
        append(work.face, queued, closest.hit, closest.face);
        append(work.b1, queued, closest.hit, closest.b1);
        append(work.b2, queued, closest.hit, closest.b2);
        append(work.screen_x, queued, closest.hit, sx);
        queued = append(work.screen_y, queued, closest.hit, sy);
    }
    return queued;
}

// One packet of the queue: the surface point, the view ray and the random numbers of its path.
struct QueuedHit {
    Mask active;
    Int path;
    PathIndex index;
    Vec3 direction;
    SurfacePoint point;
};

EG_INLINE QueuedHit load_hit(const SceneView& scene, const ImageTask& task, int at, int queued,
                             const Workspace& work) {
    QueuedHit q;
    q.active = first_lanes(queued - at);
    q.path = select(q.active, load(work.path + at), splat(0));
    q.index = path_index(task, q.path);
    q.direction = camera_direction(scene.camera, load(work.screen_x + at), load(work.screen_y + at));
    q.point = surface_point(scene, q.active, load(work.face + at), load(work.b1 + at), load(work.b2 + at),
                            q.direction);
    return q;
}

EG_INLINE void scatter_radiance(Workspace& work, const QueuedHit& q, Vec3 radiance) {
    for (int i = 0; i < W; ++i) {
        if (!q.active[i]) continue;
        work.radiance[0][q.path[i]] = radiance.x[i];
        work.radiance[1][q.path[i]] = radiance.y[i];
        work.radiance[2][q.path[i]] = radiance.z[i];
    }
}

// Adds the values of the task's paths to the picture, in the order of paths whatever the packet's width.
EG_INLINE void accumulate(const ImageTask& task, const Workspace& work, float* image) {
    const float* value[3] = {work.radiance[0], work.radiance[1], work.radiance[2]};
    for (int pixel = 0; pixel < task.pixel_count; ++pixel) {
        float* out = image + 3 * static_cast<int64_t>(task.first_pixel + pixel);
        for (int c = 0; c < 3; ++c) {
            double sum = 0.0;
            for (int k = 0; k < task.samples; ++k) sum += static_cast<double>(value[c][k]);
            value[c] += task.samples;
            out[c] += static_cast<float>(sum) * task.weight;
        }
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
