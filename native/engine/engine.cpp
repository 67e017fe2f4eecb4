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
#include "scene/corners/shading_normals.h"
#include "scene/textures/value_bounds.h"
#include "sdf/bricks/coefficient_blocks.h"
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

bool same_sizes(const std::vector<FieldTable>& a, const std::vector<FieldTable>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](const FieldTable& one, const FieldTable& other) {
                          return std::equal(std::begin(one.size), std::end(one.size), other.size);
                      });
}

}  // namespace

Engine::Engine(const embree::Api& api, const KernelTable& kernels, SceneTables tables, int threads)
    : api_(api), kernels_(kernels), tables_(std::move(tables)), threads_(thread_count(threads)) {
    tables_.vertices.reserve(tables_.vertices.size() + 4);  // padding, see Bvh
    for (FieldTable& field : tables_.fields) {
        field.values.assign(field.given, field.given + field.value_count());
        field.given = nullptr;
        find_signs(field.view(), {}, threads_, field.signs);
    }
    tables_.filter = inverted_filter(static_cast<PixelFilter>(tables_.filter_kind), tables_.filter_width);
    tables_.material_used = materials_of_faces(tables_);
    bound_values(tables_);
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
                       std::vector<uint32_t> faces, std::vector<uint32_t> opposite,
                       const std::vector<uint32_t>& collinear, std::vector<uint8_t> sharing,
                       const std::vector<uint32_t>& touching) {
    require_settled();
    bodies_ = nullptr;
    forget_shapes();
    kept_.clear();
    tables_.edge_vertices = std::move(vertices);
    tables_.edge_face_first = std::move(face_first);
    tables_.edge_faces = std::move(faces);
    tables_.edge_opposite = std::move(opposite);
    tables_.edge_sharing = std::move(sharing);
    tables_.touching_meshes.clear();
    for (size_t k = 0; k + 1 < touching.size(); k += 2)
        tables_.touching_meshes.push_back(
            {static_cast<int32_t>(touching[k]), static_cast<int32_t>(touching[k + 1])});
    tables_.face_collinear.assign(collinear.empty() ? 0 : tables_.faces.size() / 3, 0);
    for (const uint32_t face : collinear) tables_.face_collinear[face] = 1;
    closed_ = closed_meshes(tables_);
    connected_.assign(closed_.size(), std::nullopt);
}

void Engine::require_settled() const {
    if (!settled_) throw std::runtime_error("the scene's last update has failed; update it again");
}

void Engine::update(SceneTables next) {
    if (next.vertices.size() != tables_.vertices.size() || next.mesh_first_face != tables_.mesh_first_face ||
        !same_sizes(next.fields, tables_.fields))
        throw std::runtime_error("the scene's topology has changed; make a new renderer");
    const bool failed = !settled_;
    if (failed) bvh_ = nullptr;  // the last update was interrupted
    settled_ = false;
    std::vector<int32_t> moved;
    bool far = false;
    for (int32_t m = 0; m < tables_.first_field(); ++m) {
        const auto first = 3 * static_cast<ptrdiff_t>(tables_.mesh_first_vertex[m]);
        const auto last = 3 * static_cast<ptrdiff_t>(tables_.mesh_first_vertex[m + 1]);
        if (!failed && std::equal(next.vertices.begin() + first, next.vertices.begin() + last,
                                  tables_.vertices.begin() + first))
            continue;
        moved.push_back(m);
        far = place_vertices(m, [&](size_t k, size_t) { return next.vertices[k]; }) || far;
    }
    // Vertices of fields and of area lights, which are in no BVH.
    const auto hidden = 3 * static_cast<ptrdiff_t>(tables_.mesh_first_vertex[tables_.first_field()]);
    std::copy(next.vertices.begin() + hidden, next.vertices.end(), tables_.vertices.begin() + hidden);
    tables_.textures = std::move(next.textures);
    tables_.environment_map = std::move(next.environment_map);
    const std::vector<Bvh::ChangedField> fields = place_fields(next.fields, failed);
    take_values(std::move(next));
    moved_geometry(moved, far, fields);
    settled_ = true;
}

// Takes coefficients and transforms of fields in place. Returns what has changed.
std::vector<Bvh::ChangedField> Engine::place_fields(const std::vector<FieldTable>& next, bool all) {
    std::vector<Bvh::ChangedField> changed;
    for (size_t k = 0; k < next.size(); ++k) {
        FieldTable& field = tables_.fields[k];
        const auto& placed = next[k].to_world;
        const bool moves = all || !std::equal(std::begin(placed), std::end(placed), field.to_world);
        std::copy(std::begin(placed), std::end(placed), field.to_world);
        std::vector<uint8_t> blocks = copy_changes(next[k].given, field.values.data(), field.size, threads_);
        if (all || !blocks.empty())
            find_signs(field.view(), all ? std::vector<uint8_t>{} : blocks, threads_, field.signs);
        if (moves || !blocks.empty()) changed.push_back({static_cast<int32_t>(k), std::move(blocks), moves});
    }
    return changed;
}

void Engine::update_values(ValueTables values) {
    require_settled();
    take_values(std::move(values));
}

void Engine::take_values(ValueTables values) {
    values.filter = inverted_filter(static_cast<PixelFilter>(values.filter_kind), values.filter_width);
    static_cast<ValueTables&>(tables_) = std::move(values);
    bound_values(tables_);
    lights_ = dark_lights_ = nullptr;
    kept_.clear_values();
}

void Engine::move_vertices(int32_t mesh, const double* vertices, size_t count, const double* origin) {
    require_settled();
    if (mesh < 0 || mesh >= tables_.first_field() ||
        count != static_cast<size_t>(tables_.mesh_first_vertex[mesh + 1] - tables_.mesh_first_vertex[mesh]))
        throw std::runtime_error("the scene's topology has changed; make a new renderer");
    const double* from = vertices - 3 * static_cast<ptrdiff_t>(tables_.mesh_first_vertex[mesh]);
    settled_ = false;
    const bool far =
        place_vertices(mesh, [&](size_t k, size_t c) { return static_cast<float>(from[k] - origin[c]); });
    moved_geometry({mesh}, far, {});
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

void Engine::moved_geometry(const std::vector<int32_t>& moved, bool far,
                            const std::vector<Bvh::ChangedField>& fields) {
    if (moved.empty() && fields.empty()) return;
    lights_ = dark_lights_ = nullptr;
    bodies_ = nullptr;
    normals_ = nullptr;
    kept_.clear();
    forget_shapes();
    update_shading_normals(tables_, threads_);
    if (!bvh_) return;
    if (far) built_vertices_ = tables_.vertices;
    bvh_->update(tables_, moved, far, fields);
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
    if (closed_.size() != 1 || !tables_.fields.empty() || !lambertian_and_flat(tables_)) return false;
    if (any_medium(tables_)) return false;
    if (closed_[0] && solid_sides(*bodies(), tables_.camera)[0] == 0) return false;
    return is_convex_mesh(0);
}

// Whether no surface is between any two others: the scene has one mesh, or two separate ones, and neither
// occludes a part of itself. A ray from one mesh to the other is outside of both. Transparent surfaces are
// excluded, since their transmittance may jump anywhere.
bool Engine::hides_no_surface() const {
    if (closed_.empty() || closed_.size() > kMostConvex || !tables_.instance_mesh.empty() ||
        !tables_.fields.empty())
        return false;
    for (int32_t flags : tables_.closure_flags)
        if (flags & kHasTransparency) return false;
    for (size_t mesh = 0; mesh < closed_.size(); ++mesh)
        if (!is_convex_mesh(mesh)) return false;
    const std::lock_guard<std::mutex> lock(made_lock_);
    if (!apart_) apart_ = closed_.size() < 2 || are_apart(tables_, 0, 1);
    return *apart_;
}

DroppedSamples Engine::render(const RenderOptions& options, const Progress& progress, float* image) const {
    if (options.samples > kBlockPaths) {
        // The samples of a pixel are in several tasks, whose sums are added without rounding
        std::vector<double> sums(static_cast<size_t>(tables_.camera.width) *
                                 static_cast<size_t>(tables_.camera.height) * 3);
        return add_samples(options, 0, progress, sums.data(), image);
    }
    const ImagePlan plan(tables_.camera, options);
    std::fill_n(image, plan.pixels * 3, 0.0f);
    return trace_picture(plan, progress, [&](const SceneView& scene, const ImageTask& task, Workspace& work) {
        kernels_.radiance(scene, task, work, image);
    });
}

DroppedSamples Engine::add_samples(const RenderOptions& options, int32_t first, const Progress& progress,
                                   double* sums, float* image) const {
    const ImagePlan plan = ImagePlan(tables_.camera, options).from(first);
    const auto trace = [&](const SceneView& scene, const ImageTask& task, Workspace& work) {
        kernels_.radiance(scene, task, work, nullptr);
        for (int c = 0; c < 3; ++c) {
            const float* value = work.radiance[c];
            for (int pixel = 0; pixel < task.pixel_count; ++pixel) {
                double& sum = sums[3 * static_cast<int64_t>(task.first_pixel + pixel) + c];
                for (int k = 0; k < task.samples; ++k) sum += static_cast<double>(*value++);
            }
        }
    };
    const DroppedSamples dropped = trace_picture(plan, progress, trace);
    // Round as the kernel does, so that the mean has the same bits (path/radiance.h)
    const float weight = 1.0f / static_cast<float>(first + options.samples);
    for (int64_t k = 0; k < plan.pixels * 3; ++k) {
        const auto rounded = static_cast<float>(sums[k]);
        image[k] = std::isfinite(rounded) ? rounded * weight
                                          : static_cast<float>(sums[k] * static_cast<double>(weight));
    }
    return dropped;
}

template <typename Trace>
DroppedSamples Engine::trace_picture(const ImagePlan& plan, const Progress& progress,
                                     const Trace& trace) const {
    require_settled();
    const bool convex = hides_no_light();
    const PreparedScene prepared(api_, &bvh(), tables_, nullptr, convex, lights(),
                                 plan.options.filter_glossy);
    const SceneView& scene = prepared.view();
    auto memory = thread_memory();
    DropCount dropped;
    parallel_for(threads_, plan.chunks, progress, [&](int thread, int64_t chunk) {
        Workspace& work = (*memory)[static_cast<size_t>(thread)].paths();
        DroppedSamples lost;
        work.dropped = &lost;
        plan.for_each_task(chunk, [&](const ImageTask& task) { trace(scene, task, work); });
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

}  // namespace edgegrad
