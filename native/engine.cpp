#include "engine.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <stdexcept>

#include "boundary/boundary_plan.h"
#include "boundary/candidates.h"
#include "boundary/crossings.h"
#include "boundary/solids.h"
#include "film/pixel_filter.h"
#include "sampling_plan.h"
#include "scene/prepared.h"
#include "scene/shading_normals.h"
#include "workspace.h"

namespace edgegrad {

namespace {

// Shadow samples per pixel and sample of the picture: each costs three rays where a picture's costs two.
constexpr double kShadowShare = 0.5;

// Most samples per pixel and sample of the picture.
constexpr double kMostPrimary = 1.0, kMostShadow = 4.0;

struct BoundaryTerm {
    bool primary;  // else shadow
    BoundaryPlan plan;
    std::shared_ptr<const EdgesAndCrossings> lines;  // of the primary term
};

// The boundary terms that a call computes.
std::vector<BoundaryTerm> boundary_terms(const SceneView& scene, const EdgeList& edges,
                                         const RenderOptions& options, const Asked& asked, bool guided) {
    std::vector<BoundaryTerm> terms;
    const int64_t pixels = static_cast<int64_t>(scene.camera.width) * scene.camera.height;
    const auto add = [&](std::shared_ptr<const EdgesAndCrossings> lines, Candidates candidates,
                         double samples, bool environment) {
        const bool primary = lines != nullptr;
        const double most =
            (primary ? kMostPrimary : kMostShadow) * static_cast<double>(pixels) * options.samples;
        BoundaryPlan plan(std::move(candidates), samples, most, options, environment, primary && guided);
        if (plan.total(0) > 0) terms.push_back({primary, std::move(plan), std::move(lines)});
    };
    if (options.primary) {
        auto lines = std::make_shared<EdgesAndCrossings>(edges.tables,
                                                         find_crossings(edges.tables, asked, edges.threads));
        Candidates candidates = primary_candidates(scene, edges, asked);
        lines->add_candidates(scene.camera, candidates);
        // As many samples per pixel of edge as the picture has per pixel.
        const double samples = candidates.mass() * options.samples;
        add(std::move(lines), std::move(candidates), samples, false);
    }
    if (options.shadow && options.max_depth >= 2 && !scene.convex) {
        const double samples = kShadowShare * static_cast<double>(pixels) * options.samples;
        if (scene.emitter_count > 0) add(nullptr, shadow_candidates(scene, edges, false), samples, false);
        if (scene.has_environment) add(nullptr, shadow_candidates(scene, edges, true), samples, true);
    }
    return terms;
}

// Whether light can only leave surfaces above their triangles.
bool lambertian_and_flat(const SceneTables& tables) {
    return tables.corner_normal.empty() && tables.instance_mesh.empty() &&
           std::all_of(tables.leaf_flags.begin(), tables.leaf_flags.end(), [](int32_t flags) {
               return (flags & kLambertian) && !(flags & (kHasTransparency | kHasNormalMap));
           });
}

}  // namespace

Engine::Engine(const embree::Api& api, const KernelTable& kernels, SceneTables tables, int threads)
    : api_(api), kernels_(kernels), tables_(std::move(tables)), threads_(thread_count(threads)) {
    tables_.vertices.reserve(tables_.vertices.size() + 4);  // padding, see Bvh
    tables_.filter = inverted_filter(static_cast<PixelFilter>(tables_.filter_kind), tables_.filter_width);
    update_shading_normals(tables_, threads_);
    bvh_ = std::make_unique<Bvh>(api_, tables_, threads_);
    built_vertices_ = tables_.vertices;
}

void Engine::set_edges(std::vector<uint32_t> vertices, std::vector<uint32_t> face_first,
                       std::vector<uint32_t> faces, std::vector<uint32_t> opposite) {
    tables_.edge_vertices = std::move(vertices);
    tables_.edge_face_first = std::move(face_first);
    tables_.edge_faces = std::move(faces);
    tables_.edge_opposite = std::move(opposite);
    closed_ = closed_meshes(tables_);
    connected_ = closed_.size() == 1 && closed_[0] && connected(tables_);
    has_edges_ = true;
}

void Engine::update(SceneTables next) {
    if (next.vertices.size() != tables_.vertices.size() || next.mesh_first_face != tables_.mesh_first_face)
        throw std::runtime_error("the scene's topology has changed; make a new renderer");
    std::vector<int32_t> moved;
    bool far = false;
    for (int32_t m = 0; m < tables_.visible_meshes; ++m) {
        const auto first = 3 * static_cast<ptrdiff_t>(tables_.mesh_first_vertex[m]);
        const auto last = 3 * static_cast<ptrdiff_t>(tables_.mesh_first_vertex[m + 1]);
        if (std::equal(next.vertices.begin() + first, next.vertices.begin() + last,
                       tables_.vertices.begin() + first))
            continue;
        moved.push_back(m);
        far = place_vertices(m, [&](size_t k) { return next.vertices[k]; }) || far;
    }
    // Area lights' vertices, which no BVH holds.
    const auto hidden = 3 * static_cast<ptrdiff_t>(tables_.mesh_first_vertex[tables_.visible_meshes]);
    std::copy(next.vertices.begin() + hidden, next.vertices.end(), tables_.vertices.begin() + hidden);
    tables_.textures = std::move(next.textures);
    tables_.environment_map = std::move(next.environment_map);
    update_values(std::move(next));
    moved_vertices(moved, far);
}

void Engine::update_values(ValueTables values) {
    values.filter = inverted_filter(static_cast<PixelFilter>(values.filter_kind), values.filter_width);
    static_cast<ValueTables&>(tables_) = std::move(values);
    lights_ = nullptr;
}

void Engine::move_vertices(int32_t mesh, const double* vertices, size_t count, const double* origin) {
    if (mesh < 0 || mesh >= tables_.visible_meshes ||
        count != static_cast<size_t>(tables_.mesh_first_vertex[mesh + 1] - tables_.mesh_first_vertex[mesh]))
        throw std::runtime_error("the scene's topology has changed; make a new renderer");
    const double* from = vertices - 3 * static_cast<ptrdiff_t>(tables_.mesh_first_vertex[mesh]);
    const bool far =
        place_vertices(mesh, [&](size_t k) { return static_cast<float>(from[k] - origin[k % 3]); });
    moved_vertices({mesh}, far);
}

// The mesh's coordinates take the values of `coordinate`; whether they have moved so far from where they were
// when the BVH was built that it must be built anew: refitted boxes of far-moved triangles overlap, and
// traversal slows down. The buffers that Embree shares stay where they are.
template <typename F>
bool Engine::place_vertices(int32_t mesh, const F& coordinate) {
    constexpr double kRebuildMotion = 0.05;  // as a share of the mesh's size
    constexpr int64_t kPart = 3 << 16;
    const int64_t first = 3 * static_cast<int64_t>(tables_.mesh_first_vertex[mesh]);
    const int64_t last = 3 * static_cast<int64_t>(tables_.mesh_first_vertex[mesh + 1]);
    struct Range {
        float motion = 0.0f, low = 3e38f, high = -3e38f;
    };
    std::vector<Range> ranges(static_cast<size_t>((last - first + kPart - 1) / kPart));
    parallel_for(threads_, static_cast<int64_t>(ranges.size()), nullptr, [&](int, int64_t part) {
        Range r;
        const int64_t end = std::min(last, first + (part + 1) * kPart);
        for (int64_t i = first + part * kPart; i < end; ++i) {
            const size_t k = static_cast<size_t>(i);
            const float x = coordinate(k);
            r.motion = std::max(r.motion, std::abs(x - built_vertices_[k]));
            r.low = std::min(r.low, x);
            r.high = std::max(r.high, x);
            tables_.vertices[k] = x;
        }
        ranges[static_cast<size_t>(part)] = r;
    });
    Range all;
    for (const Range& r : ranges)
        all = {std::max(all.motion, r.motion), std::min(all.low, r.low), std::max(all.high, r.high)};
    return static_cast<double>(all.motion) > kRebuildMotion * static_cast<double>(all.high - all.low);
}

void Engine::moved_vertices(const std::vector<int32_t>& moved, bool far) {
    if (moved.empty()) return;
    lights_ = nullptr;
    if (far) built_vertices_ = tables_.vertices;
    update_shading_normals(tables_, threads_);
    bvh_->update(tables_, moved, far);
}

// Whether the scene is one convex body whose light only leaves it above its triangles.
bool Engine::hides_no_light(const std::vector<int8_t>& sides) const {
    return lambertian_and_flat(tables_) && convex_alone(tables_, sides, connected_);
}

void Engine::render(const RenderOptions& options, const Progress& progress, float* image) const {
    // Only a body that is alone may be convex; what else the sides tell concerns derivatives.
    const bool convex = connected_ && hides_no_light(solid_sides(tables_, closed_));
    const PreparedScene prepared(api_, *bvh_, tables_, nullptr, convex, lights());
    const SceneView& scene = prepared.view();
    const ImagePlan plan(scene.camera, options);
    std::fill_n(image, plan.pixels * 3, 0.0f);
    std::vector<ThreadWorkspace> work(static_cast<size_t>(threads_));
    parallel_for(threads_, plan.chunks, progress, [&](int thread, int64_t chunk) {
        plan.for_each_task(chunk, [&](const ImageTask& task) {
            kernels_.radiance(scene, task, work[thread].view(), image);
        });
    });
}

void Engine::forward(const RenderOptions& options, const Asked& asked, const Derivative& tangent,
                     const Progress& progress, float* image) const {
    const std::vector<int8_t> sides = solid_sides(tables_, closed_);
    const PreparedScene prepared(api_, *bvh_, tables_, &asked, hides_no_light(sides), lights());
    const SceneView& scene = prepared.view();
    const VertexSpan span(tables_, asked);
    const ImagePlan plan(scene.camera, options);
    std::fill_n(image, plan.pixels * 3, 0.0f);
    const DerivativeView d = derivative_view(const_cast<Derivative&>(tangent), 0, span, asked);

    // Under a static camera only moving vertices sweep over anything.
    std::vector<BoundaryTerm> terms;
    if (span.any || asked.camera || asked.instances)
        terms = boundary_terms(scene, {tables_, sides.data(), threads_}, options, asked, guided_);
    int64_t all = options.interior ? plan.chunks : 0, done = 0;
    for (const BoundaryTerm& term : terms)
        for (int pass = 0; pass < term.plan.passes(); ++pass) all += term.plan.chunks(pass);
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
    if (options.interior) {
        parallel_for(threads_, plan.chunks, part(plan.chunks), [&](int thread, int64_t chunk) {
            plan.for_each_task(chunk, [&](const ImageTask& task) {
                kernels_.interior_forward(scene, task, work[thread].view(), d, image);
            });
        });
    }
    const auto add_pass = [&](BoundaryTerm& term, int pass) {
        // Splats are stored and added in order: two threads adding to one pixel would do it in any order.
        std::vector<float> memory[5];
        for (int64_t first = 0; first < term.plan.total(pass); first += kSplatBatch) {
            const int64_t batch = std::min(kSplatBatch, term.plan.total(pass) - first);
            for (auto& column : memory) column.resize(static_cast<size_t>(batch));
            const auto splats = [&](int64_t at) -> Splats {
                return {memory[0].data() + at,
                        memory[1].data() + at,
                        {memory[2].data() + at, memory[3].data() + at, memory[4].data() + at}};
            };
            const int64_t chunks = (batch + kBoundaryChunk - 1) / kBoundaryChunk;
            parallel_for(threads_, chunks, part(chunks), [&](int thread, int64_t chunk) {
                const int64_t begin = chunk * kBoundaryChunk;
                const BoundaryTask task =
                    term.plan.task(pass, first + begin, std::min(kBoundaryChunk, batch - begin));
                Splats out = splats(begin);
                if (term.primary)
                    kernels_.primary_forward(term.lines->view(scene), task, work[thread].view(), d, out);
                else
                    kernels_.shadow_forward(scene, task, d, out);
            });
            kernels_.add_splats(scene.camera, splats(0), batch, image);
        }
    };
    for (BoundaryTerm& term : terms) {
        for (int pass = 0; pass < term.plan.passes(); ++pass) {
            if (pass > 0) term.plan.guide();
            add_pass(term, pass);
        }
    }
}

Derivative Engine::backward(const RenderOptions& options, const Asked& asked, const float* adjoint,
                            const Progress& progress) const {
    const std::vector<int8_t> sides = solid_sides(tables_, closed_);
    const PreparedScene prepared(api_, *bvh_, tables_, &asked, hides_no_light(sides), lights());
    const SceneView& scene = prepared.view();
    const VertexSpan span(tables_, asked);
    const ImagePlan plan(scene.camera, options);

    GradientGroups groups(tables_, span);
    std::vector<BoundaryTerm> terms;
    if (span.any || asked.camera || asked.instances)
        terms = boundary_terms(scene, {tables_, sides.data(), threads_}, options, asked, guided_);
    int64_t boundary_chunks = 0;
    for (const BoundaryTerm& term : terms)
        for (int pass = 0; pass < term.plan.passes(); ++pass) boundary_chunks += term.plan.chunks(pass);
    const int64_t image_chunks = options.interior ? plan.chunks : 0;

    std::vector<ThreadWorkspace> work(static_cast<size_t>(threads_));
    std::atomic<bool> stop{false};
    std::atomic<int64_t> done{0};
    // Groups take long: progress counts chunks, and cancelling is seen between them.
    const Progress report = [&](double) {
        try {
            const int64_t all = image_chunks + boundary_chunks;
            if (progress) progress(all ? static_cast<double>(done) / static_cast<double>(all) : 1.0);
        } catch (...) {
            stop = true;
            throw;
        }
    };
    const int64_t count = groups.count();
    const auto add_pass = [&](int thread, int64_t group, int pass, DerivativeView& gradient) {
        for (BoundaryTerm& term : terms) {
            if (pass >= term.plan.passes()) continue;
            for (int64_t chunk = group; chunk < term.plan.chunks(pass) && !stop; chunk += count, ++done) {
                const BoundaryTask task = term.plan.chunk(pass, chunk);
                if (term.primary)
                    kernels_.primary_backward(term.lines->view(scene), task, work[thread].view(), adjoint,
                                              gradient);
                else
                    kernels_.shadow_backward(scene, task, adjoint, gradient);
            }
        }
    };
    parallel_for(threads_, count, report, [&](int thread, int64_t group) {
        DerivativeView gradient = groups.view(group, asked);
        // A group's chunks are spread over the picture, so that groups take about equally long.
        for (int64_t chunk = group; chunk < image_chunks && !stop; chunk += count, ++done) {
            if (!plan.any_adjoint(chunk, adjoint)) continue;
            plan.for_each_task(chunk, [&](const ImageTask& task) {
                kernels_.interior_backward(scene, task, work[thread].view(), adjoint, gradient);
            });
        }
        add_pass(thread, group, 0, gradient);
    });
    bool more = false;
    for (BoundaryTerm& term : terms) {
        if (term.plan.passes() < 2) continue;
        term.plan.guide();
        more = true;
    }
    if (more)
        parallel_for(threads_, count, report, [&](int thread, int64_t group) {
            DerivativeView gradient = groups.again(group, asked);
            add_pass(thread, group, 1, gradient);
        });
    return groups.reduce(threads_);
}

std::shared_ptr<const LightList> Engine::lights() const {
    const std::lock_guard<std::mutex> lock(lights_lock_);
    if (!lights_) lights_ = std::make_shared<const LightList>(tables_);
    return lights_;
}

void Engine::probe_lights(const LightProbes& probes) const {
    kernels_.light_samples(PreparedScene(api_, *bvh_, tables_, nullptr, false, lights()).view(), probes);
}

void Engine::probe_directions(const DirectionProbes& probes) const {
    kernels_.light_directions(PreparedScene(api_, *bvh_, tables_, nullptr, false, lights()).view(), probes);
}

void Engine::probe_sky(const SkyProbes& probes) const {
    const PreparedScene prepared(api_, *bvh_, tables_, nullptr, false, lights());
    if (!prepared.view().sky.pixels) throw std::invalid_argument("the environment has no image");
    kernels_.sky(prepared.view(), probes);
}

}  // namespace edgegrad
