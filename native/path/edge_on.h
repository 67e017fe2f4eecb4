// Camera samples by the area of faces that the camera sees nearly edge-on.
//
// Where vertices or the camera move, the camera's rays slide along the surfaces that they meet
// (adjoint/vertex.h): with n the normal of the first one, D the direction of the ray,
//   dx = c + D n . (m - c)/(n . D),
// so that the derivative has a second moment of int ds/(n . D)^2 over the picture, which has no bound where a
// surface curves away from the camera (it grows with the logarithm of the number of samples), and grows as
// 1/|n . D| on a sheet. By area, ds = kappa |n . D| dA (path/camera_projection.h), the integrand is bounded.
//
// So paths are started at such faces, too: a point x by area, a point of the lens, and the ray through x's
// place in the picture, which counts if x is what it meets first. With rho samples by area expected in the
// picture's area of a pixel, beside n of the camera, all paths whose first hit is on such a face count for
//   1/(n + rho),   rho = (samples per area of the face)/(kappa |n . D|)
// (balance heuristic, Veach 1997), whatever is behind it, and for every pixel's filter alike. Pictures of an
// equirectangular camera are left as they are: a point may have several places there, or none, beyond a pole.
#pragma once

#include "film/splat.h"
#include "path/camera_projection.h"
#include "path/first_rays.h"
#include "path/run.h"
#include "path/start.h"
#include "path/stream.h"
#include "sampling/systematic.h"
#include "tasks/edge_on_task.h"
#include "tasks/splats.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// Expected samples by area per square metre where a ray has met a face; 0 on faces that have none.
EG_INLINE Float edge_on_density(const EdgeOnFaces& faces, Mask hit, Int face, Int instance) {
    const Int at = select(hit, face, splat(0));
    const Int begin = gather(faces.first, at), end = gather(faces.first + 1, at);
    const Mask listed = hit & (end > begin);
    Float density = splat(0.0f);
    if (!any(listed)) return density;
    for (int i = 0; i < W; ++i) {
        if (!listed[i]) continue;
        int32_t low = begin[i], high = end[i];
        while (high - low > 1) {
            const int32_t middle = (low + high) / 2;
            (faces.instance[middle] <= instance[i] ? low : high) = middle;
        }
        if (faces.instance[low] == instance[i]) density[i] = faces.density[low];
    }
    return density;
}

// What the recorded paths of a task count for, those of the camera relative to 1/n: multiplies what their
// vertices are worth.
static void weigh_edge_on_kernel(const SceneView& scene, const EdgeOnFaces& faces, int32_t paths,
                                 bool by_area, Workspace& work) {
    // By path; its first vertex is that which is recorded first.
    float* weight = work.radiance[0];
    for (int at = 0; at < paths; at += W) store(weight + at, splat(-1.0f));
    for (int64_t k = 0; k < work.vertices->count; ++k) {
        VertexPacket<W>& v = work.vertices->at<W>(k);
        const Mask active = load(v.active);
        const Int path = select(active, load(v.path), splat(0));
        Float w = gather(weight, path);
        const Mask starts = active & (w < 0.0f);
        if (any(starts)) {
            w = select(starts, splat(1.0f), w);
            const Int face = load(v.face), instance = load(v.instance);
            const Float density = edge_on_density(faces, starts & (face >= 0), face, instance);
            const Mask listed = density > 0.0f;
            if (any(listed)) {
                const Triangle t = placed_triangle(scene, select(listed, face, splat(0)),
                                                   select(listed, instance, splat(-1)))
                                       .triangle;
                LensPoint lens = {splat(0.0f), splat(0.0f)};
                if (scene.camera.aperture_radius > 0.0f)
                    aperture_point(scene.camera, gather(work.camera.lens_u, path),
                                   gather(work.camera.lens_v, path), lens.x, lens.y);
                const Projection view = project(scene.camera, interpolate(t, load(v.b1), load(v.b2)), lens);
                const Vec3 m = area_normal(t);
                const Float facing = abs(dot(m, view.across_of)) / max(sqrt(dot(m, m)), 1e-37f);
                const Float area = view.area * facing;  // in the picture, of an area of the face
                const Float share = area / (faces.samples * area + density);
                w = select(listed, by_area ? share : faces.samples * share, w);
            }
            for (int i = 0; i < W; ++i)
                if (starts[i]) weight[path[i]] = w[i];
        }
        for (auto& channel : v.throughput) store(channel, load(channel) * w);
    }
}

// The task's samples as recorded paths with the weights above, their places in work.camera (at kNowhere:
// none).
static void record_edge_on_kernel(const SceneView& scene, const EdgeOnTask& task, Workspace& work) {
    work.vertices->clear();
    const CameraView& camera = scene.camera;
    const double mass = task.cumulative[task.pieces], step = mass / static_cast<double>(task.total);
    int64_t piece = last_below(task.cumulative, task.pieces,
                               static_cast<double>(task.first) / static_cast<double>(task.total) * mass);
    int queued = 0;
    const int count = static_cast<int>(task.count);
    for (int at = 0; at < count; at += W) {
        PathPacket p = first_segment(task.paths.max_depth);
        p.touched = splat(-1);
        p.active = first_lanes(count - at);
        p.path = lane_index() + at;
        const PathIndex index = path_index(task.paths, p.path);
        // Sample k lies in the k-th of `total` equal parts of the mass.
        Int number = splat(0);
        for (int i = 0; i < W && at + i < count; ++i) {
            go_to(task.cumulative, task.pieces, systematic_place(task.first + at + i, task.paths.seed) * step,
                  piece);
            number[i] = static_cast<int32_t>(piece);
        }
        Float u, v, lens_u = splat(0.5f), lens_v = lens_u;
        sobol_pair(index.stream, index.sample, kPairPixel, u, v);
        LensPoint lens = {splat(0.0f), splat(0.0f)};
        if (camera.aperture_radius > 0.0f) {
            sobol_pair(index.stream, index.sample, kPairLens, lens_u, lens_v);
            aperture_point(camera, lens_u, lens_v, lens.x, lens.y);
        }
        Float c[9];
        gather_row(task.corners, 9, number, c);
        const Float b1 = sqrt(u) * (1.0f - v), b2 = sqrt(u) * v, b0 = 1.0f - b1 - b2;
        const Vec3 x =
            Vec3{c[0], c[1], c[2]} * b0 + Vec3{c[3], c[4], c[5]} * b1 + Vec3{c[6], c[7], c[8]} * b2;
        const Projection view = project(camera, x, lens);
        p.active &= view.active & in_reach(camera, view.sx, view.sy);
        if (task.adjoint && any(p.active)) {
            const Vec3 a = adjoint_at(camera, p.active, view.sx, view.sy, task.adjoint);
            for (int i = 0; i < W && at + i < count; ++i) {
                float* out = task.seen_adjoint + 3 * static_cast<int64_t>(at + i);
                out[0] = a.x[i], out[1] = a.y[i], out[2] = a.z[i];
            }
            // Where nothing is asked, nothing is traced.
            p.active &= largest_component(a) > 0.0f;
        }
        if (any(p.active)) {
            const Int face = gather(task.face, number), instance = gather(task.instance, number);
            const Closest hit = trace_first(scene, p, view.sx, view.sy, lens_u, lens_v, embree::kCoherent);
            p.active &= hit.hit & (hit.face == face) & (hit.instance == instance);
            Closest none = hit;
            none.hit = splat(0);
            queued = append_met(work, queued, p, hit, zero3(), none);
        }
        store(work.camera.x + at, select(p.active, view.sx, 2.0f * kNowhere));
        store(work.camera.y + at, view.sy);
        store(work.camera.lens_u + at, lens_u), store(work.camera.lens_v + at, lens_v);
    }
    if (queued > 0) run_paths(scene, task.paths, work, queued);
    weigh_edge_on_kernel(scene, task.faces, count, true, work);
}

}  // namespace edgegrad::EDGEGRAD_ISA
