// Samples of the picture by the surface area of faces that the camera sees nearly edge-on.
//
// When vertices or the camera move, the point that a camera ray hits slides along its surface
// (adjoint/vertex.h). With the normal n of the surface and the direction D of the ray,
//   dx = c + D n . (m - c)/(n . D).
// The second moment of the derivative over the picture is int ds/(n . D)^2. It is unbounded where a surface
// curves away from the camera (it grows with the logarithm of the number of samples), and grows as 1/|n . D|
// on a flat sheet. The measure ds = kappa |n . D| dA (path/camera_projection.h) bounds the integrand of
// samples by area.
//
// Therefore paths also start at points of such faces: a point x by area, a point of the lens, and the ray
// through the projection of x, which contributes if x is its first hit. Let rho be the expected number of
// samples by area in a pixel, and n the number of camera samples. By the balance heuristic (Veach 1997), all
// paths whose first hit is on such a face have the weight
//   1/(n + rho),   rho = (samples per area of the face)/(kappa |n . D|).
// The weight does not depend on the rest of the path or on the pixel filter. Equirectangular pictures are not
// sampled by area, because a point may have several projections there, or none beyond a pole.
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

// Expected samples by area per square metre at a hit; 0 on faces that are not sampled by area.
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

// Multiplies the throughput of recorded paths by their balance heuristic weights; those of camera paths are
// relative to 1/n.
static void weigh_edge_on_kernel(const SceneView& scene, const EdgeOnFaces& faces, int32_t paths,
                                 bool by_area, Workspace& work) {
    // Other paths, which a medium scatters before the face, are found by camera samples alone
    const float others = by_area ? 0.0f : 1.0f;
    // Find the weight of each path, at its first recorded vertex on a surface
    float* weight = work.radiance[0];
    for (int at = 0; at < paths; at += W) store(weight + at, splat(-1.0f));
    for (int64_t k = 0; k < work.vertices->count; ++k) {
        VertexPacket<W>& v = work.vertices->at<W>(k);
        const Mask active = load(v.active);
        const Int path = select(active, load(v.path), splat(0));
        const Int face = load(v.face), instance = load(v.instance);
        // The light of a ray that passes a medium is that of the surface behind it
        const Mask starts =
            active & (gather(weight, path) < 0.0f) & ~((face == splat(kInMedium)) & load(v.passes));
        if (any(starts)) {
            Float w = splat(others);
            // Look up the density of samples by area at the first hit
            const Float density = edge_on_density(faces, starts & (face >= 0), face, instance);
            const Mask listed = density > 0.0f;
            if (any(listed)) {
                // Compute the weight from the face's projected area
                const Triangle t = placed_triangle(scene, listed, face, instance).triangle;
                LensPoint lens = {splat(0.0f), splat(0.0f)};
                if (scene.camera.aperture_radius > 0.0f)
                    aperture_point(scene.camera, gather(work.camera.lens_u, path),
                                   gather(work.camera.lens_v, path), lens.x, lens.y);
                const Projection view = project(scene.camera, interpolate(t, load(v.b1), load(v.b2)), lens);
                const Vec3 m = area_normal(t);
                const Float facing = abs(dot(m, view.across_of)) / max(sqrt(dot(m, m)), 1e-37f);
                const Float area = view.area * facing;  // area on the picture per area of the face
                const Float share = area / (faces.samples * area + density);
                w = select(listed, by_area ? share : faces.samples * share, w);
            }
            for (int i = 0; i < W; ++i)
                if (starts[i]) weight[path[i]] = w[i];
        }
    }
    // Apply the weights to the paths' vertices
    for (int64_t k = 0; k < work.vertices->count; ++k) {
        VertexPacket<W>& v = work.vertices->at<W>(k);
        const Float found = gather(weight, select(load(v.active), load(v.path), splat(0)));
        const Float w = select(found < 0.0f, splat(others), found);
        for (auto& channel : v.throughput) store(channel, load(channel) * w);
    }
}

// Records the paths of a task's samples by area, with the weights above. Stores their picture coordinates in
// work.camera (kNowhere for samples without a path).
static void record_edge_on_kernel(const SceneView& scene, const EdgeOnTask& task, Workspace& work) {
    work.vertices->clear();
    const CameraView& camera = scene.camera;
    const double weight = task.cumulative[task.pieces], step = weight / static_cast<double>(task.total);
    int64_t entry = last_below(task.cumulative, task.pieces,
                               static_cast<double>(task.first) / static_cast<double>(task.total) * weight);
    int queued = 0;
    const int count = static_cast<int>(task.count);
    for (int at = 0; at < count; at += W) {
        // Choose the faces by systematic sampling
        PathPacket p = first_segment(task.paths.max_depth);
        p.touched = splat(-1);
        p.active = first_lanes(count - at);
        p.path = lane_index() + at;
        const PathIndex index = path_index(task.paths, p.path);
        // Sample k lies in the k-th of `total` equal parts of the total weight.
        Int number = splat(0);
        for (int i = 0; i < W && at + i < count; ++i) {
            go_to(task.cumulative, task.pieces, systematic_place(task.first + at + i, task.paths.seed) * step,
                  entry);
            number[i] = static_cast<int32_t>(entry);
        }
        // Sample the point of the lens and the point of the face
        const auto [u, v] = sobol_pair(index, kPairPixel);
        const auto [lens_u, lens_v] = lens_numbers(camera, index);
        const LensPoint lens = lens_of(camera, lens_u, lens_v);
        Float c[9];
        gather_row(task.corners, 9, number, c);
        const Float b1 = sqrt(u) * (1.0f - v), b2 = sqrt(u) * v, b0 = 1.0f - b1 - b2;
        const Vec3 x =
            Vec3{c[0], c[1], c[2]} * b0 + Vec3{c[3], c[4], c[5]} * b1 + Vec3{c[6], c[7], c[8]} * b2;
        // Project the point to the picture
        const Projection view = project(camera, x, lens);
        p.active &= view.active & in_reach(camera, view.sx, view.sy);
        // Look up the adjoint image there
        if (task.adjoint && any(p.active)) {
            const Vec3 a = adjoint_at(camera, p.active, view.sx, view.sy, task.adjoint);
            for (int i = 0; i < W && at + i < count; ++i) {
                float* out = task.seen_adjoint + 3 * static_cast<int64_t>(at + i);
                out[0] = a.x[i], out[1] = a.y[i], out[2] = a.z[i];
            }
            // Trace nothing where the adjoint is zero.
            p.active &= largest_component(a) > 0.0f;
        }
        // Trace the camera ray and keep paths whose first hit is the sampled face
        if (any(p.active)) {
            const Int face = gather(task.face, number), instance = gather(task.instance, number);
            const Closest hit = trace_first(scene, p, view.sx, view.sy, lens_u, lens_v, embree::kCoherent);
            p.active &= hit.hit & (hit.face == face) & (hit.instance == instance);
            queued = append_met(work, queued, p, hit, zero3());
        }
        // Store the picture coordinates
        store(work.camera.x + at, select(p.active, view.sx, 2.0f * kNowhere));
        store(work.camera.y + at, view.sy);
        store(work.camera.lens_u + at, lens_u), store(work.camera.lens_v + at, lens_v);
    }
    // Trace the paths and weigh their vertices
    if (queued > 0) run_paths(scene, task.paths, work, queued);
    weigh_edge_on_kernel(scene, task.faces, count, true, work);
}

}  // namespace edgegrad::EDGEGRAD_ISA
