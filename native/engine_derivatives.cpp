// The engine's derivatives: the interior term, by sweeps over recorded paths, and the boundary terms.
#include <algorithm>
#include <atomic>
#include <optional>

#include "boundary/solids.h"
#include "boundary_terms.h"
#include "curve_terms.h"
#include "drop_count.h"
#include "edge_on_term.h"
#include "engine.h"
#include "interior_rules.h"
#include "passed_leaves.h"
#include "sampling_plan.h"
#include "scene/prepared.h"
#include "scene/shading_normals.h"
#include "shading/bsdf/lobe.h"
#include "specular_term.h"
#include "workspace.h"

namespace edgegrad {

namespace {

// Horizon samples per pixel and sample of the picture. As many as the picture's have 1/20 of the noise of the
// interior term under a rectangle or a sphere, 1/12 under an emissive mesh, 1/6 under the sky, and cost twice
// its time.
constexpr double kHorizonShare = 0.125;

// A light's strength has a derivative even where it is zero.
bool wants_dark_lights(const Wanted& wanted) {
    constexpr uint64_t emission = Wanted::columns(kEmission, kEmission + 3);
    return wanted.any("light_params") ||
           (wanted.any("leaf_params") && (wanted.span("leaf_params").columns & emission) != 0);
}

// Where nothing but strengths of lights of the table is asked for, and of the environment, light of all
// others has no derivative: the rows that samples are to be spent on. Else none.
std::vector<uint8_t> lights_alone(const SceneTables& tables, const Wanted& wanted) {
    const auto& spans = wanted.spans();
    const bool alone = wanted.any("light_params") && !wanted.moves_lights() &&
                       spans.size() == 1 + static_cast<size_t>(wanted.any("environment"));
    std::vector<uint8_t> rows(alone ? tables.lights.kind.size() : 0);
    for (size_t k = 0; k < rows.size(); ++k)
        rows[k] = wanted.any("light_params", k * kLightParams, (k + 1) * kLightParams);
    return rows;
}

// Where nothing but how wide lobes of shaders are is asked for: these lobes (bits).
int32_t lobes_alone(const Wanted& wanted) {
    if (wanted.spans().size() != 1 || !wanted.any("leaf_params")) return 0;
    constexpr uint64_t rough = Wanted::columns(kRoughness, kRoughness + 1),
                       coat = Wanted::columns(kCoatRoughness, kCoatRoughness + 1);
    const uint64_t columns = wanted.span("leaf_params").columns;
    if ((columns & ~(rough | coat)) != 0) return 0;
    return ((columns & rough) ? 1 << kMirrorLobe | 1 << kInterfaceLobe : 0) |
           ((columns & coat) ? 1 << kCoatLobe : 0);
}

// What boundary terms see of the tables' derivatives.
Asked asked_for(const Wanted& wanted) {
    return {wanted.moving(),
            wanted.any("camera"),
            wanted.any("instance_to_world"),
            wanted.moves_lights(),
            wanted.any("environment_rotation"),
            wanted.any("environment") || wanted.any("environment_pixels")};
}

// The options with a term's samples per pixel, of those that are counted by pixel.
RenderOptions of_term(RenderOptions options, const LearnedSampling* learned, DerivativeTerm term) {
    if (learned)
        options.samples =
            std::max(1, static_cast<int32_t>(std::lround(learned->share[term] * options.samples)));
    return options;
}

bool anything_moves(const Asked& asked) {
    return asked.camera || asked.lights || asked.rotation || any_mesh_moves(asked);
}

// Whether faces with shading normals of their own may cut off other light than before (boundary/horizon.h;
// core/shadow_plan.py has the rule in words).
bool horizons_move(const SceneView& scene, const RenderOptions& options, const Asked& asked) {
    const bool bent = scene.corner_normal || scene.all_flags & kHasNormalMap;
    if (!bent || options.max_depth < 2 || !(options.shadow || options.indirect)) return false;
    constexpr int32_t kPointlike = 1 << kPointSource | 1 << kDirectionLight;
    const bool lit = scene.has_environment || (scene.lights.kinds & ~kPointlike);
    if (!lit && !(options.indirect && options.max_depth > 2)) return false;
    const bool sized = scene.lights.sized_count + scene.lights.sized_distant > 0;
    // A light that faces what it lights turns with that.
    const bool turns = scene.lights.kinds & 1 << kDiskLight;
    return any_mesh_moves(asked) || asked.rotation || (asked.lights && sized) || (asked.camera && turns);
}

RenderOptions horizon_options(RenderOptions options) {
    options.samples = std::max(1, static_cast<int>(std::lround(kHorizonShare * options.samples)));
    options.seed ^= 0x1f83d9abu;
    return options;
}

}  // namespace

// What both modes prepare: the scene, the interior term's chunks of the picture, and the boundary terms.
struct Engine::DerivativeCall {
    DerivativeCall(const Engine& e, const RenderOptions& options, const Wanted& asked_of,
                   LearnedSampling* learned)
        : engine(e),
          wanted(asked_of),
          sides(solid_sides(*e.bodies(), e.tables_.camera)),
          asked(asked_for(wanted)),
          geometry(wanted.geometry() || moves_chains(e.tables_, wanted)),
          lights(e.lights_for(wanted)),
          prepared(e.api_, *e.bvh_, e.tables_, &asked, e.hides_no_light(), lights),
          scene(prepared.view()),
          plan(interior_plan(of_term(options, learned, kInteriorTerm))),
          horizon(scene.camera, horizon_options(of_term(options, learned, kShadowTerm)), kHorizonPaths),
          tables(differentiable_tables(scene, e.tables_)),
          passed(passed_leaves(scene, e.tables_, wanted, geometry)),
          leaves(asked_leaves()),
          values_alone(wanted.values_alone(scene)) {
        if (options.interior && !shading_is_constant(scene, e.tables_, wanted, options.max_depth))
            image_chunks = plan.chunks;
        if (anything_moves(asked) && (options.primary || options.shadow || options.indirect)) {
            const auto normals = e.normals();
            terms = boundary_terms(
                scene, {e.tables_, sides.data(), normals->data(), e.kernels_, e.threads_, lights, e.kept_},
                options, asked, e.guided_, e.aimed_, learned);
        }
        if (image_chunks > 0 && geometry)
            edge_on = EdgeOnTerm::of(scene, e.tables_, sides, plan.options, asked, e.threads_);
        if (edge_on) boundary_chunks += edge_on->chunks();
        if (horizons_move(scene, options, asked)) horizon_chunks = horizon.chunks;
        specular =
            SpecularTerm::of(scene, e.tables_, of_term(options, learned, kPrimaryTerm), wanted, e.kept_);
        if (specular) boundary_chunks += specular->chunks();
        for (const BoundaryTerm& term : terms)
            for (int pass = 0; pass < term.plan.passes(); ++pass) boundary_chunks += term.plan.chunks(pass);
    }

    // A sweep over paths whose vertices are then recorded.
    AdjointTask recording(const ImageTask& task, Workspace& work, AdjointWorkspace& adjoint,
                          const DifferentiableTables& of) const {
        AdjointTask sweep = adjoint.task(task, work);
        sweep.tables = &of;
        sweep.geometry = geometry;
        sweep.camera_moves = wanted.any("camera");
        work.vertices->geometry = sweep.geometry;
        work.vertices->misses = misses_change();
        work.vertices->leaves = leaves;
        work.vertices->passed.leaves = passed.empty() ? nullptr : passed.data();
        return sweep;
    }

    // Renders a task's paths with their vertices; the task of sweeps over them.
    AdjointTask record(const ImageTask& task, Workspace& work, AdjointWorkspace& adjoint,
                       const DifferentiableTables& of) const {
        const AdjointTask sweep = recording(task, work, adjoint, of);
        engine.kernels_.record(scene, task, work);
        if (edge_on) edge_on->weigh(engine.kernels_, scene, task.pixel_count * task.samples, work);
        AdjointWorkspace::release(work);
        return sweep;
    }

    // Whether rays that meet nothing bring what has a derivative: by itself, or since they turn.
    bool misses_change() const {
        return scene.lights.sized_count + scene.lights.sized_distant > 0 || scene.sky.pixels ||
               wanted.any("environment");
    }

    // The horizon term's part of a task of its paths.
    HorizonTask horizon_task(const ImageTask& image, DroppedSamples& lost) const {
        const RenderOptions& options = horizon.options;
        return {image, options.shadow, options.indirect && options.max_depth > 2, &lost};
    }

    // The same where light is a product and a sum of what is asked for.
    ValueTask record_values(const ImageTask& task, Workspace& work, AdjointWorkspace& adjoint,
                            const DifferentiableTables& of) const {
        ValueTask sweep = adjoint.value_task(task, work);
        sweep.tables = &of;
        ValueMemory& values = *sweep.values;
        constexpr uint64_t emission = Wanted::columns(kEmission, kEmission + 3);
        const uint64_t columns = wanted.any("leaf_params") ? wanted.span("leaf_params").columns : 0;
        values.emission = (columns & emission) != 0;
        values.colors = (columns & ~emission) != 0;
        values.rows = wanted.any("light_params");
        values.environment = wanted.any("environment");
        values.leaves = leaves;
        values.leaves.everywhere = values.emission || values.rows || values.environment;
        engine.kernels_.record_values(scene, task, work);
        AdjointWorkspace::release(work);
        return sweep;
    }

    // How many samples each term took.
    void count_samples(LearnedSampling& learned) const {
        std::fill_n(learned.taken, kDerivativeTerms, 0.0);
        if (image_chunks > 0)
            learned.taken[kInteriorTerm] = static_cast<double>(plan.pixels) * plan.options.samples;
        if (edge_on) learned.taken[kInteriorTerm] += static_cast<double>(edge_on->total());
        if (horizon_chunks > 0)
            learned.taken[kShadowTerm] = static_cast<double>(horizon.pixels) * horizon.options.samples;
        if (specular) learned.taken[kPrimaryTerm] += static_cast<double>(specular->total());
        for (const BoundaryTerm& term : terms)
            for (int pass = 0; pass < term.plan.passes(); ++pass)
                learned.taken[kTermOf[term.plan.kind()]] += static_cast<double>(term.plan.total(pass));
    }

    // What samples without a finite value were left out, by term.
    Dropped all_dropped() const {
        Dropped out;
        const auto add_pixels = [&out](const char* name, const DroppedSamples& d) {
            if (d.count > 0) out.push_back({name, d.count, d.first, {-1, -1}, {d.place, -1}});
        };
        add_pixels("interior", dropped.sum());
        add_pixels("shadow", dropped_horizons.sum());
        const auto add = [&out](const char* name, const DroppedSamples& d, const SceneView& view) {
            if (d.count == 0) return;
            DroppedTerm t{name, d.count, -1, {-1, -1}, {-1, -1}};
            if (d.place < 0) return out.push_back(t);  // the border of a light
            const uint32_t* face = view.edge_faces + view.edge_face_first[d.place];
            const bool crossing = d.place >= view.edge_count;
            for (int k = 0; k < 2; ++k)
                if (!crossing) t.vertices[k] = static_cast<int32_t>(view.edge_vertices[2 * d.place + k]);
            t.faces[0] = static_cast<int32_t>(face[0]);
            if (crossing && !(face[1] & kLightOfTable)) t.faces[1] = static_cast<int32_t>(face[1]);
            out.push_back(t);
        };
        for (const BoundaryTerm& term : terms)
            add(kBoundaryTerms[term.plan.kind()], term.dropped->sum(), term.view(scene));
        add(kBoundaryTerms[kPrimaryBoundary], dropped_chains.sum(), scene);
        return out;
    }

    // Which shaders have derivatives, where nothing else does. Emission is seen from everywhere, and shadows
    // of what lets light through are.
    AskedLeaves asked_leaves() const {
        const Wanted::Span span = wanted.span("leaf_params");
        AskedLeaves out;
        out.first = static_cast<int32_t>(span.first / kMaterialParams);
        out.last = static_cast<int32_t>(span.last / kMaterialParams);
        const auto glows = [&](int32_t k) { return (scene.leaf_flags[k] & kHasEmission) != 0; };
        out.everywhere = wanted.spans().size() != 1 || !wanted.any("leaf_params");
        for (int32_t k = out.first; k < out.last; ++k) out.everywhere |= glows(k);
        out.everywhere |= !passed.empty();
        out.lobes = lobes_alone(wanted);
        return out;
    }

    // Derivatives by strengths and colours are pictures: they, and what is asked for beside, have their
    // numbers.
    ImagePlan interior_plan(const RenderOptions& options) const {
        constexpr uint64_t values =
            Wanted::columns(kBaseColor, kBaseColor + 3) | Wanted::columns(kEmission, kEmission + 3);
        const bool pictures =
            wanted.any("light_params") || wanted.any("environment") ||
            (wanted.any("leaf_params") && (wanted.span("leaf_params").columns & values) != 0);
        const ImagePlan own(scene.camera, options, kRecordedPaths);
        return pictures ? own : own.sharing();
    }

    // What boundary terms read or write; null where it is not asked for.
    DerivativeView boundary_view(const GradientGroups::View& v) const {
        const auto first = static_cast<int32_t>(wanted.span("vertices").first / 3);
        return {v.vertices, first,        v.camera,        v.instances,  v.lights,
                v.rotation, asked.camera, asked.instances, asked.lights, asked.rotation};
    }

    const Engine& engine;
    const Wanted& wanted;
    const std::vector<int8_t> sides;
    const Asked asked;
    const bool geometry;  // whether positions, directions or normals of a path's vertices change
    const std::shared_ptr<const LightList> lights;
    const PreparedScene prepared;
    const SceneView& scene;
    const ImagePlan plan, horizon;
    const std::vector<NamedTable> tables;
    const std::vector<int32_t> passed;  // PassedLeaf bits by leaf; empty: none
    const AskedLeaves leaves;
    const bool values_alone;
    std::vector<BoundaryTerm> terms;
    std::optional<SpecularTerm> specular;
    std::optional<EdgeOnTerm> edge_on;
    int64_t image_chunks = 0, horizon_chunks = 0, boundary_chunks = 0;
    mutable DropCount dropped;           // by the interior term
    mutable DropCount dropped_horizons;  // by the horizon term
    mutable DropCount dropped_chains;    // by the specular one
};

std::shared_ptr<const LightList> Engine::lights_for(const Wanted& wanted) const {
    const std::vector<uint8_t> rows = lights_alone(tables_, wanted);
    return rows.empty() ? lights(wants_dark_lights(wanted))
                        : std::make_shared<const LightList>(tables_, rows);
}

void Engine::forward(const RenderOptions& options, const Wanted& wanted, TableValues tangents,
                     LearnedSampling* learned, const Progress& progress, float* image,
                     Dropped& dropped) const {
    DerivativeCall call(*this, options, wanted, learned);
    const SceneView& scene = call.scene;
    const ImagePlan& plan = call.plan;
    std::fill_n(image, plan.pixels * 3, 0.0f);
    if (wanted.any("normals")) {
        std::vector<double>& normals = tangents["normals"];
        normals.resize(tables_.normals.size(), 0.0);
        if (wanted.any("vertices"))
            push_shading_normals(tables_, threads_, tangents.at("vertices").data(), normals.data());
    }
    const DifferentiableTables tables = with_tangents(call.tables, wanted, tangents);
    const auto values = [&](const char* name) {
        return wanted.any(name) ? tangents.at(name).data() : nullptr;
    };
    double* vertices = values("vertices");
    if (vertices) vertices += wanted.span("vertices").first;
    const DerivativeView d = call.boundary_view({{},
                                                 vertices,
                                                 values("camera"),
                                                 values("instance_to_world"),
                                                 values("light_params"),
                                                 values("environment_rotation")});

    const int64_t all = call.image_chunks + call.horizon_chunks + call.boundary_chunks;
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

    std::vector<ThreadWorkspace> work(static_cast<size_t>(threads_));
    std::vector<AdjointWorkspace> adjoint_work(static_cast<size_t>(threads_));
    if (call.image_chunks > 0) {
        parallel_for(threads_, plan.chunks, part(plan.chunks), [&](int thread, int64_t chunk) {
            plan.for_each_task(chunk, [&](const ImageTask& task) {
                Workspace& w = work[static_cast<size_t>(thread)].view();
                DroppedSamples lost;
                AdjointWorkspace& memory = adjoint_work[static_cast<size_t>(thread)];
                const auto run = [&](auto sweep, auto kernel) {
                    sweep.dropped = &lost;
                    kernel(scene, sweep, w.radiance);
                };
                if (call.values_alone)
                    run(call.record_values(task, w, memory, tables), kernels_.values_forward);
                else
                    run(call.record(task, w, memory, tables), kernels_.path_forward);
                call.dropped.add(lost);
                kernels_.accumulate(task, w, image);
            });
        });
    }
    if (call.horizon_chunks > 0) {
        parallel_for(threads_, call.horizon_chunks, part(call.horizon_chunks),
                     [&](int thread, int64_t chunk) {
                         call.horizon.for_each_task(chunk, [&](const ImageTask& task) {
                             Workspace& w = work[static_cast<size_t>(thread)].view();
                             DroppedSamples lost;
                             kernels_.horizon_forward(scene, call.horizon_task(task, lost), w, d);
                             call.dropped_horizons.add(lost);
                             kernels_.accumulate(task, w, image);
                         });
                     });
    }
    // Splats are stored and added in order: two threads adding to one pixel would do it in any order.
    const auto add_samples = [&](int64_t total, const auto& run) {
        std::vector<float> memory[5];
        for (int64_t first = 0; first < total; first += kSplatBatch) {
            const int64_t batch = std::min(kSplatBatch, total - first);
            for (auto& column : memory) column.resize(static_cast<size_t>(batch));
            const auto splats = [&](int64_t at) -> Splats {
                return {memory[0].data() + at,
                        memory[1].data() + at,
                        {memory[2].data() + at, memory[3].data() + at, memory[4].data() + at}};
            };
            const int64_t chunks = (batch + kBoundaryChunk - 1) / kBoundaryChunk;
            parallel_for(threads_, chunks, part(chunks), [&](int thread, int64_t chunk) {
                const int64_t begin = chunk * kBoundaryChunk;
                Splats out = splats(begin);
                run(static_cast<size_t>(thread), first + begin, std::min(kBoundaryChunk, batch - begin), out);
            });
            kernels_.add_splats(scene.camera, splats(0), batch, image);
        }
    };
    for (int pass = 0; pass < 2; ++pass) {
        if (pass > 0) guide_second_passes(call.terms);
        for (BoundaryTerm& term : call.terms) {
            if (pass >= term.plan.passes()) continue;
            add_samples(term.plan.total(pass), [&](size_t thread, int64_t first, int64_t count, Splats& out) {
                DroppedSamples lost;
                const BoundaryTask task = term.task(pass, first, count, lost);
                kernels_.boundary[task.kind].forward(term.view(scene), task, work[thread].view(), d, out);
                term.dropped->add(lost, pass == 0 ? 0 : term.plan.total(0));
            });
        }
    }
    if (call.edge_on)
        add_samples(call.edge_on->total(), [&](size_t thread, int64_t first, int64_t count, Splats& out) {
            DroppedSamples lost;
            Workspace& w = work[thread].view();
            const ImageTask image = EdgeOnTerm::image(count);
            AdjointTask sweep = call.recording(image, w, adjoint_work[thread], tables);
            sweep.dropped = &lost;
            call.edge_on->forward(kernels_, scene, sweep, first, w, out);
            call.dropped.add(lost);
        });
    if (call.specular) {
        std::vector<ChainWorkspace> chains(static_cast<size_t>(threads_));
        add_samples(call.specular->total(), [&](size_t thread, int64_t first, int64_t count, Splats& out) {
            DroppedSamples lost;
            call.specular->forward(kernels_, scene, first, count, work[thread].view(), adjoint_work[thread],
                                   chains[thread], tables, d, out, lost);
            call.dropped_chains.add(lost);
        });
    }
    dropped = call.all_dropped();
    if (progress) progress(1.0);  // second passes may have spared samples
}

TableValues Engine::backward(const RenderOptions& options, const Wanted& wanted, const float* adjoint,
                             LearnedSampling* learned, const Progress& progress, Dropped& dropped) const {
    DerivativeCall call(*this, options, wanted, learned);
    const SceneView& scene = call.scene;
    const ImagePlan& plan = call.plan;

    GradientGroups groups(call.tables, wanted, spare_);
    for (BoundaryTerm& term : call.terms)
        if (term.masses) term.plan.record();

    std::vector<ThreadWorkspace> work(static_cast<size_t>(threads_));
    std::vector<AdjointWorkspace> adjoint_work(static_cast<size_t>(threads_));
    std::atomic<bool> stop{false};
    std::atomic<int64_t> done{0};
    // Groups take long: progress counts chunks, and cancelling is seen between them.
    const Progress report = [&](double) {
        try {
            const int64_t all = call.image_chunks + call.horizon_chunks + call.boundary_chunks;
            if (progress) progress(all ? static_cast<double>(done) / static_cast<double>(all) : 1.0);
        } catch (...) {
            stop = true;
            throw;
        }
    };
    const int64_t count = groups.count();
    const auto add_pass = [&](int thread, int64_t group, int pass, const GradientGroups::View& gradient) {
        DerivativeView d = call.boundary_view(gradient);
        Workspace& w = work[static_cast<size_t>(thread)].view();
        for (BoundaryTerm& term : call.terms) {
            if (pass >= term.plan.passes()) continue;
            for (int64_t chunk = group; chunk < term.plan.chunks(pass) && !stop; chunk += count, ++done) {
                DroppedSamples lost;
                const int64_t first = chunk * kBoundaryChunk;
                const BoundaryTask task =
                    term.task(pass, first, std::min(kBoundaryChunk, term.plan.total(pass) - first), lost);
                kernels_.boundary[task.kind].backward(term.view(scene), task, w, adjoint, d);
                term.dropped->add(lost, pass == 0 ? 0 : term.plan.total(0));
            }
        }
    };
    std::vector<ChainWorkspace> chains(static_cast<size_t>(threads_));
    const auto add_specular = [&](size_t thread, int64_t group, const GradientGroups::View& gradient) {
        const DerivativeView d = call.boundary_view(gradient);
        const SpecularTerm& term = *call.specular;
        for (int64_t chunk = group; chunk < term.chunks() && !stop; chunk += count, ++done) {
            const int64_t first = chunk * kBoundaryChunk;
            DroppedSamples lost;
            term.backward(kernels_, scene, first, std::min(kBoundaryChunk, term.total() - first),
                          work[thread].view(), adjoint_work[thread], chains[thread], gradient.tables, d,
                          adjoint, lost);
            call.dropped_chains.add(lost);
        }
    };
    const auto add_edge_on = [&](size_t thread, int64_t group, const GradientGroups::View& gradient) {
        const EdgeOnTerm& term = *call.edge_on;
        for (int64_t chunk = group; chunk < term.chunks() && !stop; chunk += count, ++done) {
            const int64_t first = chunk * kBoundaryChunk;
            DroppedSamples lost;
            Workspace& w = work[thread].view();
            const ImageTask image = EdgeOnTerm::image(std::min(kBoundaryChunk, term.total() - first));
            AdjointTask sweep = call.recording(image, w, adjoint_work[thread], gradient.tables);
            sweep.dropped = &lost;
            term.backward(kernels_, scene, sweep, first, w, adjoint);
            call.dropped.add(lost);
        }
    };
    parallel_for(threads_, count, report, [&](int thread, int64_t group) {
        const GradientGroups::View gradient = groups.view(group);
        Workspace& w = work[static_cast<size_t>(thread)].view();
        // A group's chunks are spread over the picture, so that groups take about equally long.
        for (int64_t chunk = group; chunk < call.image_chunks && !stop; chunk += count, ++done) {
            if (!plan.any_adjoint(chunk, adjoint)) continue;
            plan.for_each_task(chunk, [&](const ImageTask& task) {
                DroppedSamples lost;
                AdjointWorkspace& memory = adjoint_work[static_cast<size_t>(thread)];
                const auto run = [&](auto sweep, auto kernel) {
                    sweep.dropped = &lost;
                    kernel(scene, sweep, adjoint);
                };
                if (call.values_alone)
                    run(call.record_values(task, w, memory, gradient.tables), kernels_.values_backward);
                else
                    run(call.record(task, w, memory, gradient.tables), kernels_.path_backward);
                call.dropped.add(lost);
            });
        }
        for (int64_t chunk = group; chunk < call.horizon_chunks && !stop; chunk += count, ++done) {
            if (!call.horizon.any_adjoint(chunk, adjoint)) continue;
            DerivativeView d = call.boundary_view(gradient);
            call.horizon.for_each_task(chunk, [&](const ImageTask& task) {
                DroppedSamples lost;
                kernels_.horizon_backward(scene, call.horizon_task(task, lost), w, adjoint, d);
                call.dropped_horizons.add(lost);
            });
        }
        if (call.edge_on) add_edge_on(static_cast<size_t>(thread), group, gradient);
        add_pass(thread, group, 0, gradient);
        if (call.specular) add_specular(static_cast<size_t>(thread), group, gradient);
    });
    guide_second_passes(call.terms);
    if (std::any_of(call.terms.begin(), call.terms.end(),
                    [](const BoundaryTerm& term) { return term.plan.passes() == 2; }))
        parallel_for(threads_, count, report,
                     [&](int thread, int64_t group) { add_pass(thread, group, 1, groups.again(group)); });
    for (const BoundaryTerm& term : call.terms)
        if (term.masses) term.plan.teach(*term.masses);
    if (learned) call.count_samples(*learned);
    if (progress) progress(1.0);  // second passes may have spared samples
    dropped = call.all_dropped();
    TableValues gradients = groups.reduce(threads_);
    if (wanted.any("normals") && wanted.any("vertices"))
        pull_shading_normals(tables_, threads_, gradients.at("normals").data(),
                             gradients.at("vertices").data());
    return gradients;
}

}  // namespace edgegrad
