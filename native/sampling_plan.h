// How a call's work is cut into tasks: pixels and samples of the picture, samples of the boundary,
// and groups of gradients. Nothing here depends on the number of threads.
#pragma once

#include <algorithm>
#include <cmath>

#include "engine.h"
#include "scene/camera_row.h"

namespace edgegrad {

// The picture as chunks of consecutive pixels.
struct ImagePlan {
    ImagePlan(const CameraView& camera, const RenderOptions& options)
        : pixels(static_cast<int64_t>(camera.width) * camera.height),
          options(options),
          camera(camera),
          per_chunk(std::max(1, kBlockPaths / options.samples)),
          chunks((pixels + per_chunk - 1) / per_chunk) {}

    // The tasks of a chunk: one, unless a single pixel has more samples than a task holds.
    template <typename F>
    void for_each_task(int64_t chunk, const F& run) const {
        const int64_t first = chunk * per_chunk;
        ImageTask task{};
        task.first_pixel = static_cast<int32_t>(first);
        task.pixel_count = static_cast<int32_t>(std::min<int64_t>(per_chunk, pixels - first));
        task.max_depth = options.max_depth;
        task.seed = options.seed;
        task.limits = options.limits;
        task.width = camera.width;
        task.row = task.first_pixel / camera.width;
        task.column = task.first_pixel % camera.width;
        task.skipped_row = camera.full_width - camera.width;
        task.skipped_all = camera.window_y * camera.full_width + camera.window_x;
        task.weight = 1.0f / static_cast<float>(options.samples);
        for (int sample = 0; sample < options.samples; sample += kBlockPaths) {
            task.first_sample = sample;
            task.samples = std::min(kBlockPaths, options.samples - sample);
            run(task);
        }
    }

    // Whether any pixel of the chunk has a non-zero adjoint; where none has, nothing is traced.
    bool any_adjoint(int64_t chunk, const float* adjoint) const {
        const int64_t first = chunk * per_chunk, last = std::min<int64_t>(first + per_chunk, pixels);
        return std::any_of(adjoint + 3 * first, adjoint + 3 * last, [](float a) { return a != 0.0f; });
    }

    int64_t pixels;
    RenderOptions options;
    CameraView camera;
    int per_chunk;
    int64_t chunks;
};

// The vertices of the moving meshes as one span: only these need memory for derivatives.
struct VertexSpan {
    VertexSpan(const SceneTables& tables, const Asked& asked) {
        for (size_t k = 0; k < asked.moving.size(); ++k) {
            if (!asked.moving[k]) continue;
            const int32_t begin = tables.mesh_first_vertex[k], end = tables.mesh_first_vertex[k + 1];
            first = any ? std::min(first, begin) : begin;
            last = any ? std::max(last, end) : end;
            any = true;
        }
    }
    bool any = false;
    int32_t first = 0, last = 0;
};

// View of a derivative whose vertex table starts at vertex `table_first`.
inline DerivativeView derivative_view(Derivative& d, int32_t table_first, const VertexSpan& span,
                                      const Asked& asked) {
    return {d.vertices.data(),
            table_first,
            d.albedo.data(),
            d.emission.data(),
            d.point_intensity.data(),
            d.sun_irradiance.data(),
            d.environment.data(),
            d.camera.data(),
            d.instance_to_world.data(),
            span.any,
            asked.colors,
            asked.camera,
            asked.instances};
}

// Gradient buffers, summed in a fixed order.
class GradientGroups {
 public:
    GradientGroups(const SceneTables& tables, const VertexSpan& span) : tables_(tables), span_(span) {
        const size_t size = 3 * static_cast<size_t>(span.last - span.first) + 2 * tables.albedo.size() +
                            tables.point_intensity.size() + tables.sun_irradiance.size() + 3 + kCameraFloats +
                            tables.instance_to_world.size();
        // Many groups balance the load, but each costs memory to clear and to sum.
        const size_t groups = std::clamp<size_t>((size_t{1} << 22) / size, 4, 32);
        groups_.resize(groups);
    }

    int64_t count() const { return static_cast<int64_t>(groups_.size()); }

    // A group's buffers, cleared.
    DerivativeView view(int64_t group, const Asked& asked) {
        Derivative& d = groups_[static_cast<size_t>(group)];
        d.vertices.assign(3 * static_cast<size_t>(span_.last - span_.first), 0.0);
        d.albedo.assign(tables_.albedo.size(), 0.0);
        d.emission.assign(tables_.emission.size(), 0.0);
        d.point_intensity.assign(tables_.point_intensity.size(), 0.0);
        d.sun_irradiance.assign(tables_.sun_irradiance.size(), 0.0);
        d.environment.assign(3, 0.0);
        d.camera.assign(kCameraFloats, 0.0);
        d.instance_to_world.assign(tables_.instance_to_world.size(), 0.0);
        return again(group, asked);
    }
    // The same buffers with what is in them.
    DerivativeView again(int64_t group, const Asked& asked) {
        return derivative_view(groups_[static_cast<size_t>(group)], span_.first, span_, asked);
    }

    Derivative reduce(int threads) {
        Derivative total;
        total.vertices.assign(tables_.vertices.size(), 0.0);
        total.albedo.assign(tables_.albedo.size(), 0.0);
        total.emission.assign(tables_.emission.size(), 0.0);
        total.point_intensity.assign(tables_.point_intensity.size(), 0.0);
        total.sun_irradiance.assign(tables_.sun_irradiance.size(), 0.0);
        total.environment.assign(3, 0.0);
        total.camera.assign(kCameraFloats, 0.0);
        total.instance_to_world.assign(tables_.instance_to_world.size(), 0.0);
        constexpr int64_t kPart = 1 << 16;
        const int64_t size = 3 * static_cast<int64_t>(span_.last - span_.first);
        double* out = total.vertices.data() + 3 * static_cast<int64_t>(span_.first);
        parallel_for(threads, (size + kPart - 1) / kPart, nullptr, [&](int, int64_t part) {
            const int64_t end = std::min(size, (part + 1) * kPart);
            for (const Derivative& d : groups_)
                for (int64_t k = part * kPart; k < end; ++k) out[k] += d.vertices[static_cast<size_t>(k)];
        });
        for (const Derivative& d : groups_) {
            add(total.albedo, d.albedo);
            add(total.emission, d.emission);
            add(total.point_intensity, d.point_intensity);
            add(total.sun_irradiance, d.sun_irradiance);
            add(total.environment, d.environment);
            add(total.camera, d.camera);
            add(total.instance_to_world, d.instance_to_world);
        }
        return total;
    }

 private:
    static void add(std::vector<double>& to, const std::vector<double>& from) {
        for (size_t k = 0; k < to.size(); ++k) to[k] += from[k];
    }

    const SceneTables& tables_;
    VertexSpan span_;
    std::vector<Derivative> groups_;
};

}  // namespace edgegrad
