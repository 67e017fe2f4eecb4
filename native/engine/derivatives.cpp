// The engine's derivatives: the interior term, by sweeps over recorded paths, and the boundary terms.
#include <algorithm>
#include <atomic>

#include "engine/derivative_call.h"
#include "scene/shading_normals.h"
#include "tasks/adjoint_task.h"
#include "tasks/boundary_task.h"
#include "tasks/dropped_samples.h"
#include "tasks/image_task.h"
#include "tasks/splats.h"
#include "tasks/workspace_view.h"

namespace edgegrad {

void Engine::forward(const RenderOptions& options, const Requested& requested, TableValues tangents,
                     LearnedSampling* learned, const Progress& progress, float* image, Dropped& dropped,
                     Decisions& decided) const {
    require_settled();
    DerivativeCall call(*this, options, requested, learned);
    const SceneView& scene = call.scene;
    const ImagePlan& plan = call.plan;
    std::fill_n(image, plan.pixels * 3, 0.0f);
    if (requested.any("normals")) {
        Zeros& normals = tangents["normals"];
        normals.resize(tables_.normals.size());
        if (requested.any("vertices"))
            push_shading_normals(tables_, threads_, tangents.at("vertices").data(), normals.data());
    }
    const DifferentiableTables tables = with_tangents(call.tables, requested, tangents);
    const auto values = [&](const char* name) {
        return requested.any(name) ? tangents.at(name).data() : nullptr;
    };
    double* vertices = values("vertices");
    if (vertices) vertices += requested.span("vertices").first;
    const DerivativeView d = call.boundary_view({{},
                                                 vertices,
                                                 values("camera"),
                                                 values("instance_to_world"),
                                                 values("light_params"),
                                                 values("environment_rotation")});

    const int64_t all = call.image_chunks + call.horizon_chunks + call.rim_chunks + call.boundary_chunks;
    int64_t done = 0;
    // Progress of a part of `size` chunks as that of the whole.
    const auto part = [&](int64_t size) -> Progress {
        const double low = static_cast<double>(done) / static_cast<double>(all);
        const double share = static_cast<double>(size) / static_cast<double>(all);
        done += size;
        return [&progress, low, share](double fraction) {
            if (progress) progress(low + share * fraction);
        };
    };

    auto memory = thread_memory();
    std::vector<ThreadMemory>& of_thread = *memory;
    // Splats are stored and added in order: two threads adding to one pixel would do it in any order.
    const auto add_samples = [&](int64_t total, const auto& run) {
        std::vector<float> values[5];
        for (int64_t first = 0; first < total; first += kSplatBatch) {
            const int64_t batch = std::min(kSplatBatch, total - first);
            for (auto& column : values) column.resize(static_cast<size_t>(batch));
            const auto splats = [&](int64_t at) -> Splats {
                return {values[0].data() + at,
                        values[1].data() + at,
                        {values[2].data() + at, values[3].data() + at, values[4].data() + at}};
            };
            const int64_t chunks = (batch + kBoundaryChunk - 1) / kBoundaryChunk;
            parallel_for(threads_, chunks, part(chunks), [&](int thread, int64_t chunk) {
                const int64_t begin = chunk * kBoundaryChunk;
                Splats out = splats(begin);
                run(static_cast<size_t>(thread), first + begin, std::min(kBoundaryChunk, batch - begin), out);
            });
            for (int64_t at = 0; at < batch; at += kBoundaryChunk, may_cancel())
                kernels_.add_splats(scene.camera, splats(at), std::min(kBoundaryChunk, batch - at), image);
        }
    };
    const auto add_pass = [&](int pass) {
        if (call.specular && pass < call.specular->passes())
            add_samples(call.specular->total(pass),
                        [&](size_t thread, int64_t first, int64_t count, Splats& out) {
                            DroppedSamples lost;
                            const auto timed = call.clock.run(call.specular_part());
                            call.specular->forward(kernels_, scene, pass, first, count, of_thread[thread],
                                                   tables, d, out, lost);
                            call.dropped_chains.add(lost, pass == 0 ? 0 : call.specular->total(0));
                        });
        for (BoundaryTerm& term : call.terms) {
            if (pass >= term.plan.passes()) continue;
            add_samples(term.plan.total(pass), [&](size_t thread, int64_t first, int64_t count, Splats& out) {
                DroppedSamples lost;
                const BoundaryTask task = term.task(pass, first, count, lost);
                const auto timed = call.clock.run(kPartOf[task.kind]);
                kernels_.boundary[task.kind].forward(term.view(scene), task, of_thread[thread].paths(), d,
                                                     out);
                term.dropped->add(lost, pass == 0 ? 0 : term.plan.total(0));
            });
        }
    };
    add_pass(0);
    if (call.specular) call.specular->guide();
    call.thin_interior(guide_second_passes(call.terms), part(0), of_thread);
    if (call.image_chunks > 0) {
        parallel_for(threads_, plan.chunks, part(plan.chunks), [&](int thread, int64_t chunk) {
            const auto timed = call.clock.run(Part::kInterior);
            plan.for_each_task(chunk, [&](const ImageTask& task) {
                ThreadMemory& mine = of_thread[static_cast<size_t>(thread)];
                Workspace& w = mine.paths();
                DroppedSamples lost;
                const auto run = [&](auto sweep, auto kernel) {
                    sweep.dropped = &lost;
                    kernel(scene, sweep, w.radiance);
                };
                if (call.values_alone)
                    run(call.record_values(task, w, mine.adjoint, tables), kernels_.values_forward);
                else
                    run(call.record(task, w, mine.adjoint, tables), kernels_.path_forward);
                call.dropped.add(lost);
                kernels_.accumulate(task, w, image);
            });
        });
    }
    if (call.horizon_chunks > 0) {
        parallel_for(threads_, call.horizon_chunks, part(call.horizon_chunks),
                     [&](int thread, int64_t chunk) {
                         const auto timed = call.clock.run(Part::kHorizons);
                         call.horizon.for_each_task(chunk, [&](const ImageTask& task) {
                             Workspace& w = of_thread[static_cast<size_t>(thread)].paths();
                             DroppedSamples lost;
                             kernels_.horizon_forward(scene, call.horizon_task(task, lost), w, d);
                             call.dropped_horizons.add(lost);
                             kernels_.accumulate(task, w, image);
                         });
                     });
    }
    if (call.rim_chunks > 0) {
        parallel_for(threads_, call.rim_chunks, part(call.rim_chunks), [&](int thread, int64_t chunk) {
            const auto timed = call.clock.run(Part::kRims);
            call.rims.for_each_task(chunk, [&](const ImageTask& task) {
                ThreadMemory& mine = of_thread[static_cast<size_t>(thread)];
                Workspace& w = mine.paths();
                DroppedSamples lost;
                AdjointTask sweep = call.record_rims(task, w, mine.adjoint, tables);
                sweep.dropped = &lost;
                kernels_.path_forward(scene, sweep, w.radiance);
                call.dropped.add(lost);
                kernels_.accumulate(task, w, image);
            });
        });
    }
    add_pass(1);
    if (call.edge_on)
        add_samples(call.edge_on->total(), [&](size_t thread, int64_t first, int64_t count, Splats& out) {
            DroppedSamples lost;
            const auto timed = call.clock.run(Part::kEdgeOn);
            ThreadMemory& mine = of_thread[thread];
            Workspace& w = mine.paths();
            const ImageTask image = EdgeOnTerm::image(count);
            AdjointTask sweep = call.recording(image, w, mine.adjoint, tables);
            sweep.dropped = &lost;
            call.edge_on->forward(kernels_, scene, sweep, first, w, out);
            call.dropped.add(lost);
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
    const SceneView& scene = call.scene;
    const ImagePlan& plan = call.plan;

    GradientGroups groups(call.tables, requested, zeroed_pool_);
    for (BoundaryTerm& term : call.terms)
        if (term.masses) term.plan.record();

    auto memory = thread_memory();
    std::vector<ThreadMemory>& of_thread = *memory;
    std::atomic<int64_t> done{0};
    const Progress report = [&](double) {  // groups take long: progress counts chunks
        const int64_t all = call.image_chunks + call.horizon_chunks + call.rim_chunks + call.boundary_chunks;
        if (progress) progress(all ? static_cast<double>(done) / static_cast<double>(all) : 1.0);
    };
    const int64_t count = groups.count();
    const auto add_pass = [&](int thread, int64_t group, int pass, const GradientGroups::View& gradient) {
        DerivativeView d = call.boundary_view(gradient);
        Workspace& w = of_thread[static_cast<size_t>(thread)].paths();
        for (BoundaryTerm& term : call.terms) {
            if (pass >= term.plan.passes()) continue;
            for (int64_t chunk = group; chunk < term.plan.chunks(pass) && !cancelled();
                 chunk += count, ++done) {
                DroppedSamples lost;
                const int64_t first = chunk * kBoundaryChunk;
                const auto timed = call.clock.run(kPartOf[term.plan.kind()]);
                const BoundaryTask task =
                    term.task(pass, first, std::min(kBoundaryChunk, term.plan.total(pass) - first), lost);
                kernels_.boundary[task.kind].backward(term.view(scene), task, w, adjoint, d);
                term.dropped->add(lost, pass == 0 ? 0 : term.plan.total(0));
            }
        }
    };
    const auto add_specular = [&](size_t thread, int64_t group, int pass,
                                  const GradientGroups::View& gradient) {
        if (!call.specular || pass >= call.specular->passes()) return;
        const DerivativeView d = call.boundary_view(gradient);
        SpecularTerm& term = *call.specular;
        for (int64_t chunk = group; chunk < term.chunks(pass) && !cancelled(); chunk += count, ++done) {
            const int64_t first = chunk * kBoundaryChunk;
            DroppedSamples lost;
            const auto timed = call.clock.run(call.specular_part());
            term.backward(kernels_, scene, pass, first, std::min(kBoundaryChunk, term.total(pass) - first),
                          of_thread[thread], gradient.tables, d, adjoint, lost);
            call.dropped_chains.add(lost, pass == 0 ? 0 : term.total(0));
        }
    };
    const auto add_edge_on = [&](size_t thread, int64_t group, const GradientGroups::View& gradient) {
        const EdgeOnTerm& term = *call.edge_on;
        for (int64_t chunk = group; chunk < term.chunks() && !cancelled(); chunk += count, ++done) {
            const int64_t first = chunk * kBoundaryChunk;
            DroppedSamples lost;
            const auto timed = call.clock.run(Part::kEdgeOn);
            ThreadMemory& mine = of_thread[thread];
            Workspace& w = mine.paths();
            const ImageTask image = EdgeOnTerm::image(std::min(kBoundaryChunk, term.total() - first));
            AdjointTask sweep = call.recording(image, w, mine.adjoint, gradient.tables);
            sweep.dropped = &lost;
            term.backward(kernels_, scene, sweep, first, w, adjoint);
            call.dropped.add(lost);
        }
    };
    parallel_for(threads_, count, report, [&](int thread, int64_t group) {
        const GradientGroups::View gradient = groups.view(group);
        add_pass(thread, group, 0, gradient);
        add_specular(static_cast<size_t>(thread), group, 0, gradient);
    });
    if (call.specular) call.specular->guide();
    call.thin_interior(guide_second_passes(call.terms), report, of_thread);
    parallel_for(threads_, count, report, [&](int thread, int64_t group) {
        const GradientGroups::View gradient = groups.again(group);
        ThreadMemory& mine = of_thread[static_cast<size_t>(thread)];
        Workspace& w = mine.paths();
        // A group's chunks are spread over the picture, so that groups take about equally long.
        for (int64_t chunk = group; chunk < call.image_chunks && !cancelled(); chunk += count, ++done) {
            if (!plan.any_adjoint(chunk, adjoint)) continue;
            const auto timed = call.clock.run(Part::kInterior);
            plan.for_each_task(chunk, [&](const ImageTask& task) {
                DroppedSamples lost;
                const auto run = [&](auto sweep, auto kernel) {
                    sweep.dropped = &lost;
                    kernel(scene, sweep, adjoint);
                };
                if (call.values_alone)
                    run(call.record_values(task, w, mine.adjoint, gradient.tables), kernels_.values_backward);
                else
                    run(call.record(task, w, mine.adjoint, gradient.tables), kernels_.path_backward);
                call.dropped.add(lost);
            });
        }
        for (int64_t chunk = group; chunk < call.horizon_chunks && !cancelled(); chunk += count, ++done) {
            if (!call.horizon.any_adjoint(chunk, adjoint)) continue;
            const auto timed = call.clock.run(Part::kHorizons);
            DerivativeView d = call.boundary_view(gradient);
            call.horizon.for_each_task(chunk, [&](const ImageTask& task) {
                DroppedSamples lost;
                kernels_.horizon_backward(scene, call.horizon_task(task, lost), w, adjoint, d);
                call.dropped_horizons.add(lost);
            });
        }
        for (int64_t chunk = group; chunk < call.rim_chunks && !cancelled(); chunk += count, ++done) {
            if (!call.rims.any_adjoint(chunk, adjoint)) continue;
            const auto timed = call.clock.run(Part::kRims);
            call.rims.for_each_task(chunk, [&](const ImageTask& task) {
                DroppedSamples lost;
                AdjointTask sweep = call.record_rims(task, w, mine.adjoint, gradient.tables);
                sweep.dropped = &lost;
                kernels_.path_backward(scene, sweep, adjoint);
                call.dropped.add(lost);
            });
        }
        if (call.edge_on) add_edge_on(static_cast<size_t>(thread), group, gradient);
        add_specular(static_cast<size_t>(thread), group, 1, gradient);
        add_pass(thread, group, 1, gradient);
    });
    memory_pool_.give(std::move(memory));
    for (const BoundaryTerm& term : call.terms)
        if (term.masses) term.plan.teach(*term.masses);
    if (learned) call.count_samples(*learned);
    if (progress) progress(1.0);  // second passes may have spared samples
    dropped = call.all_dropped();
    call.note_effort();
    decided = std::move(call.decided);
    TableValues gradients = groups.reduce(threads_);
    if (requested.any("normals") && requested.any("vertices"))
        pull_shading_normals(tables_, threads_, gradients.at("normals").data(),
                             gradients.at("vertices").data());
    return gradients;
}

}  // namespace edgegrad
