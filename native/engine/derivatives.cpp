// The engine's derivatives: the interior term, by sweeps over recorded paths, and the boundary terms.
#include <algorithm>
#include <atomic>

#include "engine/derivative_call.h"
#include "scene/corners/shading_normals.h"
#include "tasks/splats.h"

namespace edgegrad {

void Engine::forward(const RenderOptions& options, const Requested& requested, TableValues tangents,
                     LearnedSampling* learned, const Progress& progress, float* image, Dropped& dropped,
                     Decisions& decided) const {
    require_settled();
    DerivativeCall call(*this, options, requested, learned);
    const SceneView& scene = call.scene;
    std::fill_n(image, 3 * static_cast<int64_t>(scene.camera.width) * scene.camera.height, 0.0f);
    if (requested.any(FloatTable::kNormals)) {
        Zeros& normals = tangents[FloatTable::kNormals];
        normals.resize(tables_.normals.size());
        if (requested.any(FloatTable::kVertices))
            push_shading_normals(tables_, threads_, tangents.at(FloatTable::kVertices).data(),
                                 normals.data());
    }
    const DifferentiableTables tables = with_tangents(call.tables, requested, tangents);
    const auto values = [&](FloatTable table) {
        return requested.any(table) ? tangents.at(table).data() : nullptr;
    };
    double* vertices = values(FloatTable::kVertices);
    if (vertices) vertices += requested.span(FloatTable::kVertices).first;
    const DerivativeView d =
        call.boundary_view({tables, vertices, values(FloatTable::kCamera), values(FloatTable::kInstances),
                            values(FloatTable::kLights), values(FloatTable::kEnvironmentRotation)});

    auto memory = thread_memory();
    const int64_t all = call.chunks();
    int64_t done = 0;
    const auto run_chunks = [&](const TermPass& p, int64_t first, int64_t chunks, const auto& splats_of) {
        const auto before = static_cast<double>(done);
        const Progress part = [&](double fraction) {
            const double chunk = before + fraction * static_cast<double>(chunks);
            if (progress) progress(chunk / static_cast<double>(all));
        };
        parallel_for(threads_, chunks, part, [&](int thread, int64_t chunk) {
            ThreadMemory& mine = (*memory)[static_cast<size_t>(thread)];
            TermRun run{kernels_, scene, mine, tables, d, nullptr, image, splats_of(chunk)};
            const auto timed = call.clock.run(p.term->part);
            p.term->run(run, p.pass, first + chunk);
            mine.check();
        });
        done += chunks;
    };
    // Splats are stored and then added in order, since threads would add to a pixel in random order.
    const auto add_splats = [&](const TermPass& p) {
        std::vector<float> values[5];
        const int64_t total = p.term->splats(p.pass);
        for (int64_t first = 0; first < total; first += kSplatBatch) {
            const int64_t batch = std::min(kSplatBatch, total - first);
            for (auto& column : values) column.resize(static_cast<size_t>(batch));
            const auto splats = [&](int64_t chunk) -> Splats {
                const int64_t at = chunk * kBoundaryChunk;
                return {values[0].data() + at,
                        values[1].data() + at,
                        {values[2].data() + at, values[3].data() + at, values[4].data() + at}};
            };
            const int64_t chunks = (batch + kBoundaryChunk - 1) / kBoundaryChunk;
            run_chunks(p, first / kBoundaryChunk, chunks, splats);
            for (int64_t k = 0; k < chunks; ++k, may_cancel())
                kernels_.add_splats(scene.camera, splats(k),
                                    std::min(kBoundaryChunk, batch - k * kBoundaryChunk), image);
        }
    };
    const Progress pilot = [&](double) {
        if (progress) progress(static_cast<double>(done) / static_cast<double>(all));
    };
    call.run(DerivativeMode::kForward, pilot, *memory, [&](const std::vector<TermPass>& passes) {
        for (const TermPass& p : passes)
            if (p.term->has_splats())
                add_splats(p);
            else
                run_chunks(p, 0, p.term->chunks(p.pass), [](int64_t) { return Splats{}; });
    });
    memory_pool_.give(std::move(memory));
    dropped = call.all_dropped();
    call.note_effort();
    decided = std::move(call.decided);
    if (progress) progress(1.0);  // second passes may have spared samples
}

TableValues Engine::backward(const RenderOptions& options, const Requested& requested, const float* adjoint,
                             LearnedSampling* learned, const Progress& progress, Dropped& dropped,
                             Decisions& decided) const {
    require_settled();
    DerivativeCall call(*this, options, requested, learned);
    GradientGroups groups(call.tables, requested, zeroed_pool_);
    for (Term* term : call.terms()) term->record();

    auto memory = thread_memory();
    std::atomic<int64_t> done{0};
    const Progress report = [&](double) {  // groups take long: progress counts chunks
        const int64_t all = call.chunks();
        if (progress) progress(all ? static_cast<double>(done) / static_cast<double>(all) : 1.0);
    };
    bool begun = false;
    call.run(DerivativeMode::kReverse, report, *memory, [&](const std::vector<TermPass>& passes) {
        parallel_for(threads_, groups.count(), report, [&](int thread, int64_t group) {
            ThreadMemory& mine = (*memory)[static_cast<size_t>(thread)];
            const GradientGroups::View gradient = begun ? groups.again(group) : groups.view(group);
            TermRun run{kernels_, call.scene, mine,    gradient.tables, call.boundary_view(gradient),
                        adjoint,  nullptr,    Splats{}};
            // A group's chunks are spread over the picture, so that groups take about equally long.
            for (const TermPass& p : passes) {
                const int64_t chunks = p.term->chunks(p.pass);
                const auto timed = call.clock.run(p.term->part);
                for (int64_t chunk = group; chunk < chunks && !cancelled(); chunk += groups.count(), ++done) {
                    p.term->run(run, p.pass, chunk);
                    mine.check();
                }
            }
        });
        begun = true;
    });
    memory_pool_.give(std::move(memory));
    for (Term* term : call.terms()) term->teach();
    if (learned) call.count_samples(*learned);
    if (progress) progress(1.0);  // second passes may have spared samples
    dropped = call.all_dropped();
    call.note_effort();
    decided = std::move(call.decided);
    TableValues gradients = groups.reduce(threads_);
    if (requested.any(FloatTable::kNormals) && requested.any(FloatTable::kVertices))
        pull_shading_normals(tables_, threads_, gradients.at(FloatTable::kNormals).data(),
                             gradients.at(FloatTable::kVertices).data());
    return gradients;
}

}  // namespace edgegrad
