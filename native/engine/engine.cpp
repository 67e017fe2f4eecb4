#include "engine/engine.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "boundary/curves/candidates.h"
#include "boundary/meshes/convex_meshes.h"
#include "engine/call_scene.h"
#include "engine/decisions/picture_facts.h"
#include "engine/drop_count.h"
#include "engine/image_tasks.h"
#include "engine/workspace.h"
#include "film/pixel_filter.h"
#include "scene/shading_normals.h"
#include "tasks/image_task.h"
#include "tasks/kernel_table.h"

namespace edgegrad {

namespace {

// With more meshes, one may be between two others.
constexpr size_t kMostConvex = 2;

std::vector<uint8_t> materials_of_faces(const SceneTables& tables) {
    std::vector<uint8_t> used(tables.material_first_closure.size() - 1, 0);
    const auto faces =
        static_cast<size_t>(tables.mesh_first_face[static_cast<size_t>(tables.visible_meshes)]);
    for (size_t face = 0; face < faces; ++face) used[static_cast<size_t>(tables.face_material[face])] = 1;
    return used;
}

// Whether surfaces emit and scatter light only into the half space above their triangles.
bool lambertian_and_flat(const SceneTables& tables) {
    return tables.corner_normal.empty() && tables.instance_mesh.empty() &&
           std::all_of(tables.closure_flags.begin(), tables.closure_flags.end(), [](int32_t flags) {
               return (flags & kLambertian) && !(flags & (kHasTransparency | kHasNormalMap));
           });
}

}  // namespace

Engine::Engine(const embree::Api& api, const KernelTable& kernels, SceneTables tables, int threads)
    : api_(api), kernels_(kernels), tables_(std::move(tables)), threads_(thread_count(threads)) {
    tables_.vertices.reserve(tables_.vertices.size() + 4);  // padding, see Bvh
    tables_.filter = inverted_filter(static_cast<PixelFilter>(tables_.filter_kind), tables_.filter_width);
    tables_.material_used = materials_of_faces(tables_);
    update_shading_normals(tables_, threads_);
}

const Bvh& Engine::bvh() const {
    const std::lock_guard<std::mutex> lock(made_lock_);
    if (!bvh_) {
        built_vertices_ = tables_.vertices;
        bvh_ = std::make_unique<Bvh>(api_, tables_, threads_);
    }
    return *bvh_;
}

void Engine::set_edges(std::vector<uint32_t> vertices, std::vector<uint32_t> face_first,
                       std::vector<uint32_t> faces, std::vector<uint32_t> opposite) {
    require_settled();
    bodies_ = nullptr;
    forget_shapes();
    kept_.clear();
    tables_.edge_vertices = std::move(vertices);
    tables_.edge_face_first = std::move(face_first);
    tables_.edge_faces = std::move(faces);
    tables_.edge_opposite = std::move(opposite);
    closed_ = closed_meshes(tables_);
    connected_.assign(closed_.size(), std::nullopt);
}

void Engine::require_settled() const {
    if (!settled_) throw std::runtime_error("the scene's last update has failed; update it again");
}

void Engine::update(SceneTables next) {
    if (next.vertices.size() != tables_.vertices.size() || next.mesh_first_face != tables_.mesh_first_face)
        throw std::runtime_error("the scene's topology has changed; make a new renderer");
    const bool failed = !settled_;
    if (failed) bvh_ = nullptr;  // the last update was interrupted
    settled_ = false;
    std::vector<int32_t> moved;
    bool far = false;
    for (int32_t m = 0; m < tables_.visible_meshes; ++m) {
        const auto first = 3 * static_cast<ptrdiff_t>(tables_.mesh_first_vertex[m]);
        const auto last = 3 * static_cast<ptrdiff_t>(tables_.mesh_first_vertex[m + 1]);
        if (!failed && std::equal(next.vertices.begin() + first, next.vertices.begin() + last,
                                  tables_.vertices.begin() + first))
            continue;
        moved.push_back(m);
        far = place_vertices(m, [&](size_t k, size_t) { return next.vertices[k]; }) || far;
    }
    // Vertices of area lights, which are in no BVH.
    const auto hidden = 3 * static_cast<ptrdiff_t>(tables_.mesh_first_vertex[tables_.visible_meshes]);
    std::copy(next.vertices.begin() + hidden, next.vertices.end(), tables_.vertices.begin() + hidden);
    tables_.textures = std::move(next.textures);
    tables_.environment_map = std::move(next.environment_map);
    take_values(std::move(next));
    moved_vertices(moved, far);
    settled_ = true;
}

void Engine::update_values(ValueTables values) {
    require_settled();
    take_values(std::move(values));
}

void Engine::take_values(ValueTables values) {
    values.filter = inverted_filter(static_cast<PixelFilter>(values.filter_kind), values.filter_width);
    static_cast<ValueTables&>(tables_) = std::move(values);
    lights_ = dark_lights_ = nullptr;
    kept_.clear_values();
}

void Engine::move_vertices(int32_t mesh, const double* vertices, size_t count, const double* origin) {
    require_settled();
    if (mesh < 0 || mesh >= tables_.visible_meshes ||
        count != static_cast<size_t>(tables_.mesh_first_vertex[mesh + 1] - tables_.mesh_first_vertex[mesh]))
        throw std::runtime_error("the scene's topology has changed; make a new renderer");
    const double* from = vertices - 3 * static_cast<ptrdiff_t>(tables_.mesh_first_vertex[mesh]);
    settled_ = false;
    const bool far =
        place_vertices(mesh, [&](size_t k, size_t c) { return static_cast<float>(from[k] - origin[c]); });
    moved_vertices({mesh}, far);
    settled_ = true;
}

// Writes the values of `coordinate` to the mesh's vertices, in place, since Embree shares the buffers.
// Returns whether the vertices have moved so far since the BVH was built that it must be built again.
// Refitted boxes of such triangles overlap, which slows down traversal.
template <typename F>
bool Engine::place_vertices(int32_t mesh, const F& coordinate) {
    constexpr double kRebuildMotion = 0.05;  // as a share of the mesh's size
    constexpr int64_t kPart = 1 << 14;
    const int64_t first = tables_.mesh_first_vertex[mesh], last = tables_.mesh_first_vertex[mesh + 1];
    struct Range {
        float motion = 0.0f, low = 3e38f, high = -3e38f;
        void add(const Range& r) {
            motion = std::max(motion, r.motion), low = std::min(low, r.low), high = std::max(high, r.high);
        }
    };
    std::vector<Range> ranges(static_cast<size_t>((last - first + kPart - 1) / kPart));
    parallel_for(threads_, static_cast<int64_t>(ranges.size()), nullptr, [&](int, int64_t part) {
        Range along[3];  // separate axes, so that their minima have no dependency on each other
        const int64_t end = std::min(last, first + (part + 1) * kPart);
        for (int64_t v = first + part * kPart; v < end; ++v) {
            for (size_t c = 0; c < 3; ++c) {
                const size_t k = 3 * static_cast<size_t>(v) + c;
                const float x = coordinate(k, c);
                along[c].add({bvh_ ? std::abs(x - built_vertices_[k]) : 0.0f, x, x});
                tables_.vertices[k] = x;
            }
        }
        for (const Range& r : along) ranges[static_cast<size_t>(part)].add(r);
    });
    Range all;
    for (const Range& r : ranges) all.add(r);
    return static_cast<double>(all.motion) > kRebuildMotion * static_cast<double>(all.high - all.low);
}

void Engine::moved_vertices(const std::vector<int32_t>& moved, bool far) {
    if (moved.empty()) return;
    lights_ = dark_lights_ = nullptr;
    bodies_ = nullptr;
    normals_ = nullptr;
    kept_.clear();
    forget_shapes();
    update_shading_normals(tables_, threads_);
    if (!bvh_) return;
    if (far) built_vertices_ = tables_.vertices;
    bvh_->update(tables_, moved, far);
}

std::shared_ptr<const std::vector<SolidBody>> Engine::bodies() const {
    const std::lock_guard<std::mutex> lock(made_lock_);
    if (!bodies_)
        bodies_ = std::make_shared<const std::vector<SolidBody>>(solid_bodies(tables_, closed_, threads_));
    return bodies_;
}

// Unit normals of the faces.
std::shared_ptr<const std::vector<float>> Engine::normals() const {
    const std::lock_guard<std::mutex> lock(made_lock_);
    if (!normals_) normals_ = std::make_shared<const std::vector<float>>(unit_normals(tables_, threads_));
    return normals_;
}

void Engine::forget_shapes() {
    const std::lock_guard<std::mutex> lock(made_lock_);
    convex_.clear();
    apart_.reset();
}

// Whether a mesh occludes no part of itself: a flat sheet, or a convex body.
bool Engine::is_convex_mesh(size_t mesh) const {
    const int8_t side = (*bodies())[mesh].side;
    const std::lock_guard<std::mutex> lock(made_lock_);
    convex_.resize(closed_.size());
    std::optional<bool>& convex = convex_[mesh];
    if (!convex && closed_[mesh]) {
        convex = side != 0 && is_convex(tables_, mesh, side, threads_);
        std::optional<bool>& connected = connected_[mesh];
        if (*convex && !connected) connected = is_connected(tables_, mesh);
        convex = *convex && *connected;
    } else if (!convex)
        convex = is_flat(tables_, mesh);
    return *convex;
}

// By mesh: whether it emits light, and occludes no part of itself. Lights are sampled by groups, and only
// meshes that form a group of their own are tested.
std::vector<uint8_t> Engine::clear_emitters(const LightList& lights) const {
    std::vector<uint8_t> clear(closed_.size(), 0);
    for (int32_t mesh : lights.top_mesh())
        if (mesh >= 0 && !clear[static_cast<size_t>(mesh)])
            clear[static_cast<size_t>(mesh)] = is_convex_mesh(static_cast<size_t>(mesh));
    return clear;
}

// Whether the scene is a flat sheet or one convex body, seen from outside, that emits and scatters light only
// above its triangles.
bool Engine::hides_no_light() const {
    if (closed_.size() != 1 || !lambertian_and_flat(tables_)) return false;
    if (closed_[0] && solid_sides(*bodies(), tables_.camera)[0] == 0) return false;
    return is_convex_mesh(0);
}

// Whether no surface is between any two others: the scene has one mesh, or two separate ones, and neither
// occludes a part of itself. A ray from one mesh to the other is outside of both. Transparent surfaces are
// excluded, since their transmittance may jump anywhere.
bool Engine::hides_no_surface() const {
    if (closed_.empty() || closed_.size() > kMostConvex || !tables_.instance_mesh.empty()) return false;
    for (int32_t flags : tables_.closure_flags)
        if (flags & kHasTransparency) return false;
    for (size_t mesh = 0; mesh < closed_.size(); ++mesh)
        if (!is_convex_mesh(mesh)) return false;
    const std::lock_guard<std::mutex> lock(made_lock_);
    if (!apart_) apart_ = closed_.size() < 2 || are_apart(tables_, 0, 1);
    return *apart_;
}

DroppedSamples Engine::render(const RenderOptions& options, const Progress& progress, float* image) const {
    require_settled();
    const bool convex = hides_no_light();
    const PreparedScene prepared(api_, &bvh(), tables_, nullptr, convex, lights());
    const SceneView& scene = prepared.view();
    const ImagePlan plan(scene.camera, options);
    std::fill_n(image, plan.pixels * 3, 0.0f);
    auto memory = thread_memory();
    DropCount dropped;
    parallel_for(threads_, plan.chunks, progress, [&](int thread, int64_t chunk) {
        Workspace& work = (*memory)[static_cast<size_t>(thread)].paths();
        DroppedSamples lost;
        work.dropped = &lost;
        plan.for_each_task(chunk,
                           [&](const ImageTask& task) { kernels_.radiance(scene, task, work, image); });
        work.dropped = nullptr;
        dropped.add(lost);
    });
    memory_pool_.give(std::move(memory));
    return dropped.sum();
}

PictureFacts Engine::picture_facts() const {
    require_settled();
    return edgegrad::picture_facts(PreparedScene(api_, nullptr, tables_, nullptr, false, lights()).view(),
                                   tables_);
}

std::shared_ptr<std::vector<ThreadMemory>> Engine::thread_memory() const {
    auto memory = memory_pool_.take();
    if (memory->empty()) *memory = std::vector<ThreadMemory>(static_cast<size_t>(threads_));
    return memory;
}

std::shared_ptr<const LightList> Engine::lights(bool dark_too) const {
    const std::lock_guard<std::mutex> lock(made_lock_);
    std::shared_ptr<const LightList>& list = dark_too ? dark_lights_ : lights_;
    if (!list) list = std::make_shared<const LightList>(tables_, dark_too);
    return list;
}

void Engine::probe_lights(const LightProbes& probes) const {
    require_settled();
    kernels_.light_samples(PreparedScene(api_, &bvh(), tables_, nullptr, false, lights()).view(), probes);
}

void Engine::probe_directions(const DirectionProbes& probes) const {
    require_settled();
    kernels_.light_directions(PreparedScene(api_, &bvh(), tables_, nullptr, false, lights()).view(), probes);
}

void Engine::probe_environment(const EnvironmentProbes& probes) const {
    require_settled();
    const PreparedScene prepared(api_, &bvh(), tables_, nullptr, false, lights());
    if (!prepared.view().environment_image.pixels)
        throw std::invalid_argument("the environment has no image");
    kernels_.environment(prepared.view(), probes);
}

}  // namespace edgegrad
