// Chooses the number of samples of the interior term, given the variance of the boundary terms, and
// distributes them over the picture.
//
// If the boundary terms are far noisier, more samples of the interior term do not improve the sum. A pilot
// over a part of the picture estimates the interior term's variance. It assumes motions of the size with
// which boundary terms estimate their variance (boundary/samples/sample_plan.h). The estimate does not depend
// on the tangent or the adjoint, so both modes take the same samples and are exact transposes of each other.
// The pilot's values are not used, and its random numbers are independent, so that the result stays unbiased.
//
// Else few pixels often carry most of the noise: highlights of narrow lobes, contact, faces seen edge-on.
// With many samples, a second pilot over the whole picture estimates the variance of each pixel, for which
// the numbers of samples are then chosen (engine/sample_distribution.h). It is part of the term's samples.
#include <algorithm>
#include <utility>

#include "engine/derivative_call.h"
#include "engine/sample_distribution.h"
#include "scene/corners/shading_normals.h"
#include "tasks/adjoint_task.h"
#include "tasks/dropped_samples.h"
#include "tasks/image_task.h"
#include "tasks/seed_tags.h"
#include "tasks/workspace_view.h"

namespace edgegrad {
namespace {

// One of so many samples of the picture is in the pilot; the fewest chunks of a picture that has a pilot; the
// most samples in the pilot.
constexpr int64_t kStride = 64, kLeastChunks = 128, kMostSamples = 32 * kRecordedPaths;
// The pilot's samples of a pixel, and the pixels of one of its chunks. Few of each, so that the pilot sees
// many places of the picture: a highlight of few pixels may have all of the variance.
constexpr int kPilotSamples = 4, kPilotPixels = 16;
// In denser meshes, each vertex is met by so few paths that its derivative needs all of them.
constexpr size_t kMostVertexFloats = size_t{1} << 18;
// Up to these fractions of the boundary terms' variance, half or a quarter of the samples suffice: the saved
// time outweighs the noise.
constexpr double kHalf = 0.45, kQuarter = 0.03;

// Samples are distributed over the picture if a pixel has so many, after a pilot with a part of them; and the
// fewest pixels of a picture where that is done.
constexpr int kLeastDistributed = 512, kPilotPart = 8;
constexpr int64_t kLeastPixels = 64;

uint64_t bits_of(uint64_t k) {
    k = (k ^ (k >> 33)) * 0xff51afd7ed558ccdULL;
    return k ^ (k >> 33);
}

// A random sign, -1 or 1.
double sign_of(uint64_t k) { return (bits_of(k) & 1) ? 1.0 : -1.0; }

// A random motion of the camera's position. fill(values) sets that of the vertices, if they are requested.
// All other requested tables stand.
template <typename Fill>
TableValues motion_of(const std::vector<NamedTable>& tables, const Requested& requested, const Fill& fill) {
    TableValues out;
    for (const NamedTable& table : tables) {
        if (!requested.any(table.table)) continue;
        Zeros& values = out[table.table];
        values.assign(table.size, 0.0);
        if (table.table == FloatTable::kVertices) fill(values);
        if (table.table == FloatTable::kCamera)
            for (size_t k = 0; k < 3; ++k) values[k] = sign_of(k + 1);
    }
    return out;
}

// Shifts each mesh, and the camera, along a random diagonal. Single vertices that move alone have other
// variances than what fits and objects do.
TableValues shifts(const std::vector<NamedTable>& tables, const Requested& requested,
                   const std::vector<int32_t>& mesh_first_vertex) {
    return motion_of(tables, requested, [&](Zeros& values) {
        for (size_t mesh = 0; mesh + 1 < mesh_first_vertex.size(); ++mesh) {
            const auto first = static_cast<size_t>(mesh_first_vertex[mesh]),
                       last = static_cast<size_t>(mesh_first_vertex[mesh + 1]);
            for (size_t k = 3 * first; k < 3 * last && k < values.size(); ++k)
                values[k] = sign_of(3 * mesh + k % 3 + 4);
        }
    });
}

// Moves each coordinate up or down at random. The mean square of the derivative along such motions is the
// squared norm of the gradient.
TableValues random_motion(const std::vector<NamedTable>& tables, const Requested& requested) {
    return motion_of(tables, requested, [](Zeros& values) {
        for (size_t k = 0; k < values.size(); ++k) values[k] = sign_of(k + 1);
    });
}

}  // namespace

bool Engine::DerivativeCall::requests_motion_alone() const {
    for (const auto& span : requested.spans())
        if (span.first != FloatTable::kVertices && span.first != FloatTable::kNormals &&
            span.first != FloatTable::kCamera)
            return false;
    return requested.any(FloatTable::kVertices) || !requested.any(FloatTable::kNormals);
}

bool Engine::DerivativeCall::may_thin_interior() const {
    if (!requests_motion_alone()) return false;
    const bool vertices = requested.any(FloatTable::kVertices);
    const bool dense = vertices && engine.tables_.vertices.size() > kMostVertexFloats;
    return !learns && !dense && !divided && interior && interior->plan().chunks >= kLeastChunks &&
           interior->plan().options.samples >= 4;
}

DifferentiableTables Engine::DerivativeCall::along_motion(TableValues& motion) const {
    if (requested.any(FloatTable::kNormals))
        push_shading_normals(engine.tables_, engine.threads_, motion.at(FloatTable::kVertices).data(),
                             motion.at(FloatTable::kNormals).data());
    return with_tangents(tables, requested, motion);
}

void Engine::DerivativeCall::add_variance(const ImagePlan& pilot, const DifferentiableTables& along,
                                          int64_t chunk, ThreadMemory& memory, double* by_pixel,
                                          double* touched) const {
    pilot.for_each_task(chunk, [&](const ImageTask& task) {
        const TermRun run{engine.kernels_, scene, memory, along, {}, nullptr, nullptr, {}};
        Workspace& w = run.work();
        DroppedSamples lost;
        AdjointTask sweep = interior->record(run, task);
        sweep.dropped = &lost;
        engine.kernels_.path_forward(scene, sweep, w.radiance);
        for (int pixel = 0; pixel < task.pixel_count; ++pixel) {
            for (int k = pixel * task.samples; touched && k < (pixel + 1) * task.samples; ++k)
                if (w.radiance[0][k] != 0.0f || w.radiance[1][k] != 0.0f || w.radiance[2][k] != 0.0f)
                    touched[task.first_pixel + pixel] += 1.0 / pilot.options.samples;
            for (const float* channel : w.radiance) {
                const float* value = channel + pixel * task.samples;
                // Samples that mirror each other count as one.
                const int group = task.mirrored_pairs ? 2 : 1;
                double sum = 0.0, squares = 0.0;
                for (int k = 0; k + group <= task.samples; k += group) {
                    double one = 0.0;
                    for (int i = 0; i < group; ++i) one += static_cast<double>(value[k + i]) / group;
                    sum += one;
                    squares += one * one;
                }
                const double n = task.samples / group;
                if (n < 2.0) continue;
                by_pixel[task.first_pixel + pixel] += (squares - sum * sum / n) / (n * (n - 1.0));
            }
        }
    });
}

double Engine::DerivativeCall::interior_variance(const Progress& progress,
                                                 std::vector<ThreadMemory>& of_thread) const {
    TableValues motion = random_motion(tables, requested);
    const DifferentiableTables along = along_motion(motion);
    const ImagePlan& plan = interior->plan();
    RenderOptions fewer = plan.options;
    fewer.samples = std::min(fewer.samples, kPilotSamples);
    fewer.seed ^= kPilotSeed;
    ImagePlan pilot = interior_plan(fewer).in_chunks_of(kPilotPixels);
    pilot.dense = plan.dense;
    // Take chunks at random places of equal parts of the picture
    const int64_t most = std::min(plan.pixels * plan.options.samples / kStride, kMostSamples);
    const int64_t taken = std::clamp<int64_t>(most / (kPilotPixels * fewer.samples), 1, pilot.chunks);
    std::vector<double> variance(static_cast<size_t>(pilot.pixels), 0.0);
    parallel_for(engine.threads_, taken, progress, [&](int thread, int64_t part) {
        const int64_t first = part * pilot.chunks / taken, next = (part + 1) * pilot.chunks / taken;
        const int64_t chunk = first + static_cast<int64_t>(bits_of(static_cast<uint64_t>(part)) %
                                                           static_cast<uint64_t>(next - first));
        add_variance(pilot, along, chunk, of_thread[static_cast<size_t>(thread)], variance.data(), nullptr);
    });
    double sum = 0.0;
    for (double v : variance) sum += v;
    return sum * static_cast<double>(pilot.chunks) / static_cast<double>(taken) * fewer.samples /
           plan.options.samples;
}

void Engine::DerivativeCall::thin_interior(double boundary_variance, const Progress& progress,
                                           std::vector<ThreadMemory>& of_thread) {
    if (!(boundary_variance > 0.0) || !may_thin_interior()) return;
    const double ratio = interior_variance(progress, of_thread) / boundary_variance;
    if (!(ratio < kHalf)) return;
    divide_interior(ratio < kQuarter ? 4 : 2);
}

bool Engine::DerivativeCall::may_distribute_interior() const {
    return requests_motion_alone() && !learns && !divided && interior &&
           interior->plan().options.samples >= kLeastDistributed && interior->plan().pixels >= kLeastPixels;
}

void Engine::DerivativeCall::distribute_interior(const Progress& progress,
                                                 std::vector<ThreadMemory>& of_thread) {
    if (!may_distribute_interior()) return;
    const ImagePlan& plan = interior->plan();
    TableValues motion = shifts(tables, requested, engine.tables_.mesh_first_vertex);
    const DifferentiableTables along = along_motion(motion);
    RenderOptions fewer = plan.options;
    fewer.samples = plan.options.samples / kPilotPart;
    fewer.seed ^= kDistributionSeed;
    const ImagePlan pilot = interior_plan(fewer);
    std::vector<double> variance(static_cast<size_t>(pilot.pixels), 0.0), touched = variance;
    parallel_for(engine.threads_, pilot.chunks, progress, [&](int thread, int64_t chunk) {
        add_variance(pilot, along, chunk, of_thread[static_cast<size_t>(thread)], variance.data(),
                     touched.data());
    });
    std::vector<int32_t> numbers = distribute_samples(plan, variance, touched, 1.0 - 1.0 / kPilotPart);
    if (!numbers.empty()) interior->set_plan(plan.with_numbers(std::move(numbers)));
}

void Engine::DerivativeCall::divide_interior(int by) {
    RenderOptions fewer = interior->plan().options;
    fewer.samples = std::max(1, fewer.samples / by);
    interior->set_plan(interior_plan(fewer));
    divided = true;
    if (edge_on) sample_edge_on_faces();
}

}  // namespace edgegrad
