// The division of a picture into tasks, which is independent of the number of threads.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "scene/view.h"
#include "tasks/block_sizes.h"
#include "tasks/image_task.h"
#include "tasks/render_options.h"
#include "tasks/seed_tags.h"
#include "util/parallel.h"

namespace edgegrad {

// The picture as chunks of consecutive pixels, with at most `paths` paths each.
struct ImagePlan {
    ImagePlan(const CameraView& camera, const RenderOptions& options, int chunk_paths = kBlockPaths)
        : pixels(static_cast<int64_t>(camera.width) * camera.height),
          options(options),
          camera(camera),
          paths(chunk_paths),
          per_chunk(std::max(1, paths / options.samples)),
          chunks((pixels + per_chunk - 1) / per_chunk) {}

    // The same plan with random numbers shared by neighbouring pixels.
    ImagePlan sharing() const {
        ImagePlan p = *this;
        for (p.sample_bits = 0; p.sample_bits < 31 && 1 << p.sample_bits < options.samples;) ++p.sample_bits;
        return p;
    }

    // The same with the samples from number `first` on.
    ImagePlan from(int32_t first) const {
        ImagePlan p = *this;
        p.first_sample = first;
        return p;
    }

    // The same in chunks of so many pixels.
    ImagePlan in_chunks_of(int most) const {
        ImagePlan p = *this;
        p.per_chunk = std::min(most, per_chunk);
        p.chunks = (pixels + p.per_chunk - 1) / p.per_chunk;
        return p;
    }

    // The same with samples that mirror each other in pairs.
    ImagePlan in_pairs() const {
        ImagePlan p = *this;
        p.mirrored_pairs = options.samples > 1;
        return p;
    }

    // The same with a number of samples per pixel for each chunk.
    ImagePlan with_numbers(std::vector<int32_t> by_chunk) const {
        ImagePlan p = *this;
        p.numbers = std::move(by_chunk);
        const int32_t most = *std::max_element(p.numbers.begin(), p.numbers.end());
        while (p.sample_bits >= 0 && p.sample_bits < 31 && 1 << p.sample_bits < most) ++p.sample_bits;
        return p;
    }

    // The same with `kDenseFactor` times the samples in marked pixels, which get random numbers of their own.
    ImagePlan with_dense(std::vector<uint8_t> marks) const {
        ImagePlan p = *this;
        p.dense = std::move(marks);
        return p;
    }

    // Samples per pixel of a chunk.
    int samples_of(int64_t chunk) const {
        return numbers.empty() ? options.samples : numbers[static_cast<size_t>(chunk)];
    }

    int64_t all_samples() const {
        if (numbers.empty() && dense.empty()) return pixels * options.samples;
        int64_t sum = 0;
        for (int64_t chunk = 0; chunk < chunks; ++chunk)
            for_each_run(chunk, [&](int64_t, int64_t count, bool is_dense) {
                sum += count * samples_of(chunk) * (is_dense ? kDenseFactor : 1);
            });
        return sum;
    }

    // Visits the tasks of a chunk: one for each run of pixels that are alike, unless these have more samples
    // than a task holds. Stops if the call is cancelled.
    template <typename F>
    void for_each_task(int64_t chunk, const F& run) const {
        for_each_run(chunk, [&](int64_t first, int64_t count, bool is_dense) {
            visit_run(first, count, samples_of(chunk), is_dense, run);
        });
    }

    // Whether any pixel of the chunk has a non-zero adjoint. Other chunks are not traced.
    bool any_adjoint(int64_t chunk, const float* adjoint) const {
        const int64_t first = chunk * per_chunk, last = std::min<int64_t>(first + per_chunk, pixels);
        return std::any_of(adjoint + 3 * first, adjoint + 3 * last, [](float a) { return a != 0.0f; });
    }

    int64_t pixels;
    RenderOptions options;
    CameraView camera;
    int paths;  // most paths of a task
    int per_chunk;
    int64_t chunks;
    int32_t first_sample = 0;
    int32_t sample_bits = -1;
    bool mirrored_pairs = false;
    std::vector<int32_t> numbers;  // samples per pixel by chunk; empty: the options'
    std::vector<uint8_t> dense;    // by pixel; empty: none

 private:
    static constexpr int kDenseFactor = 8, kDenseBits = 3;

    // Calls visit(first, count, dense) for the runs of pixels of a chunk that are all dense or all not.
    template <typename F>
    void for_each_run(int64_t chunk, const F& visit) const {
        int64_t first = chunk * per_chunk;
        const int64_t end = std::min<int64_t>(first + per_chunk, pixels);
        const auto is_dense = [&](int64_t pixel) {
            return !dense.empty() && dense[static_cast<size_t>(pixel)] != 0;
        };
        while (first < end) {
            int64_t last = dense.empty() ? end : first + 1;
            while (last < end && is_dense(last) == is_dense(first)) ++last;
            visit(first, last - first, is_dense(first));
            first = last;
        }
    }

    template <typename F>
    void visit_run(int64_t first, int64_t count, int samples, bool is_dense, const F& run) const {
        ImageTask task{};
        task.first_pixel = static_cast<int32_t>(first);
        task.pixel_count = static_cast<int32_t>(count);
        task.max_depth = options.max_depth;
        task.seed = options.seed;
        task.limits = options.limits;
        task.caustics_alone = options.caustics_alone;
        task.width = camera.width;
        task.row = task.first_pixel / camera.width;
        task.column = task.first_pixel % camera.width;
        task.skipped_row = camera.full_width - camera.width;
        task.skipped_all = camera.window_y * camera.full_width + camera.window_x;
        task.sample_bits = sample_bits;
        if (is_dense) {
            samples *= kDenseFactor;
            task.seed ^= kDenseSeed;
            if (sample_bits >= 0) task.sample_bits = std::min(sample_bits + kDenseBits, 31);
        }
        task.weight = 1.0f / static_cast<float>(samples);
        task.mirrored_pairs = mirrored_pairs;
        const int most =
            task.pixel_count * samples <= paths ? samples : std::max(1, paths / task.pixel_count);
        for (int sample = 0; sample < samples && !cancelled(); sample += most) {
            task.first_sample = first_sample + sample;
            task.samples = std::min(most, samples - sample);
            run(task);
        }
    }
};

}  // namespace edgegrad
