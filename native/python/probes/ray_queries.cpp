// Bindings of ray queries, to measure them beside Embree's own (tests/benchmarks/throughput.py).
#include "python/probes/ray_queries.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <stdexcept>
#include <vector>

#include "embree/library.h"
#include "kernels/dispatch.h"
#include "python/numpy_arrays.h"
#include "scene/rays/brute_triangles.h"
#include "tasks/kernel_table.h"
#include "tasks/probe_tasks.h"
#include "util/parallel.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace edgegrad {
namespace {

constexpr int64_t kChunk = 8192;  // rays per work item: whole packets of every width

struct Vectors : InputArray<float> {
    Vectors(nb::handle array, const char* name) : InputArray(array, name, {-1, 3}) {}
};

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Rays by columns, padded to whole chunks with copies of the last ray.
struct Columns {
    std::vector<float> value[7];  // origin, direction, far
    int64_t count = 0, padded = 0;

    Columns(const Vectors& origins, const Vectors& directions, float far) {
        if (origins.shape(0) != directions.shape(0) || origins.shape(0) == 0)
            throw std::invalid_argument("there must be as many origins as directions, and at least one");
        count = static_cast<int64_t>(origins.shape(0));
        padded = (count + kChunk - 1) / kChunk * kChunk;
        for (int c = 0; c < 7; ++c) {
            value[c].resize(static_cast<size_t>(padded));
            for (int64_t k = 0; k < padded; ++k) {
                const int64_t row = 3 * std::min(k, count - 1);
                value[c][static_cast<size_t>(k)] = c < 3   ? origins.data()[row + c]
                                                   : c < 6 ? directions.data()[row + c - 3]
                                                           : far;
            }
        }
    }
};

template <int W>
double trace_packets(const embree::Api& api, embree::SceneHandle bvh, int threads, const Columns& rays,
                     bool shadow, bool coherent, int32_t* face, float* distance) {
    std::vector<embree::RayHit<W>> packets(static_cast<size_t>(rays.padded / W));
    for (int64_t k = 0; k < rays.padded; ++k) {
        embree::RayHit<W>& p = packets[static_cast<size_t>(k / W)];
        const int64_t i = k % W;
        const auto at = [&](int c) { return rays.value[c][static_cast<size_t>(k)]; };
        p.ray.org_x[i] = at(0), p.ray.org_y[i] = at(1), p.ray.org_z[i] = at(2), p.ray.tnear[i] = 0.0f;
        p.ray.dir_x[i] = at(3), p.ray.dir_y[i] = at(4), p.ray.dir_z[i] = at(5), p.ray.time[i] = 0.0f;
        p.ray.tfar[i] = at(6), p.ray.mask[i] = 0xFFFFFFFFu, p.ray.id[i] = 0, p.ray.flags[i] = 0;
        p.hit.geom_id[i] = p.hit.inst_id[i] = embree::kInvalidId;
    }
    alignas(64) int32_t valid[W];
    std::fill_n(valid, W, -1);
    const auto start = std::chrono::steady_clock::now();
    parallel_for(threads, rays.padded / kChunk, {}, [&](int, int64_t chunk) {
        embree::QueryContext context;
        embree::QueryArguments args;
        args.context = &context;
        args.flags = coherent ? embree::kCoherent : embree::kIncoherent;
        for (int64_t k = chunk * kChunk / W; k < (chunk + 1) * kChunk / W; ++k) {
            void* p = &packets[static_cast<size_t>(k)];
            if constexpr (W == 1) shadow ? api.occluded1(bvh, p, &args) : api.intersect1(bvh, p, &args);
            if constexpr (W == 4)
                shadow ? api.occluded4(valid, bvh, p, &args) : api.intersect4(valid, bvh, p, &args);
            if constexpr (W == 8)
                shadow ? api.occluded8(valid, bvh, p, &args) : api.intersect8(valid, bvh, p, &args);
            if constexpr (W == 16)
                shadow ? api.occluded16(valid, bvh, p, &args) : api.intersect16(valid, bvh, p, &args);
        }
    });
    const double seconds = seconds_since(start);
    for (int64_t k = 0; k < rays.count; ++k) {
        const embree::RayHit<W>& p = packets[static_cast<size_t>(k / W)];
        const int64_t i = k % W;
        const bool hit = shadow ? p.ray.tfar[i] < 0.0f : p.hit.geom_id[i] != embree::kInvalidId;
        face[k] = !hit ? -1 : shadow ? 0 : static_cast<int32_t>(p.hit.prim_id[i]);
        distance[k] = p.ray.tfar[i];
    }
    return seconds;
}

// One mesh and its BVH.
class RayScene {
 public:
    RayScene(nb::handle vertex_rows, nb::handle face_rows, int threads, nb::handle embree)
        : api_(embree::load(text(embree))), threads_(thread_count(threads)) {
        const Vectors vertices(vertex_rows, "vertices");
        const InputArray<int32_t> faces(face_rows, "faces", {-1, 3});
        tables_.vertices.reserve(vertices.size() + 4);  // padding, see Bvh
        tables_.vertices.assign(vertices.data(), vertices.data() + vertices.size());
        tables_.faces.assign(faces.data(), faces.data() + faces.size());
        for (int32_t v : tables_.faces)
            if (v < 0 || static_cast<size_t>(v) >= vertices.shape(0))
                throw std::invalid_argument("faces name a vertex that isn't there");
        const auto count = static_cast<int32_t>(faces.shape(0));
        tables_.face_material.assign(static_cast<size_t>(count), 0);
        tables_.mesh_first_vertex = {0, static_cast<int32_t>(vertices.shape(0))};
        tables_.mesh_first_face = {0, count};
        tables_.visible_meshes = 1;
        tables_.mesh_mask = {-1};
        const auto start = std::chrono::steady_clock::now();
        bvh_ = std::make_unique<Bvh>(api_, tables_, threads_);
        build_seconds_ = seconds_since(start);
    }

    double build_seconds() const { return build_seconds_; }

    // Moves the vertices and refits the BVH. Returns the seconds of Embree's refit alone.
    double refit(nb::handle rows) {
        const Vectors vertices(rows, "vertices");
        if (vertices.size() != tables_.vertices.size())
            throw std::invalid_argument("there must be as many vertices as before");
        std::copy_n(vertices.data(), vertices.size(), tables_.vertices.begin());
        const auto start = std::chrono::steady_clock::now();
        bvh_->update(tables_, {0}, false);
        return seconds_since(start);
    }

    // Traces rays with the engine's own queries. Returns (seconds, face or -1, distance).
    nb::tuple trace(nb::handle origins, nb::handle directions, float far, bool shadow, bool coherent,
                    bool brute_force, nb::handle instruction_set) {
        const KernelTable& kernels = edgegrad::kernels(text(instruction_set));
        const Columns rays(Vectors(origins, "origins"), Vectors(directions, "directions"), far);
        const std::vector<BruteTriangle> triangles =
            brute_force ? all_brute_triangles(tables_) : std::vector<BruteTriangle>();
        SceneView view{};
        view.api = &api_;
        view.bvh = bvh_->handle();
        view.mesh_first_face = tables_.mesh_first_face.data();
        view.mesh_count = 1;
        view.brute_triangles = triangles.data();
        view.brute_count = static_cast<int32_t>(triangles.size());
        std::vector<int32_t> face(static_cast<size_t>(rays.padded));
        std::vector<float> distance(static_cast<size_t>(rays.padded));
        const auto start = std::chrono::steady_clock::now();
        parallel_for(threads_, rays.padded / kChunk, {}, [&](int, int64_t chunk) {
            const int64_t first = chunk * kChunk;
            RayBatch batch{};
            for (int c = 0; c < 3; ++c) {
                batch.origin[c] = rays.value[c].data() + first;
                batch.direction[c] = rays.value[3 + c].data() + first;
            }
            batch.far = rays.value[6].data() + first;
            batch.count = kChunk;
            batch.shadow = shadow;
            batch.coherent = coherent;
            batch.brute_force = brute_force;
            kernels.ray_batch(view, batch, face.data() + first, distance.data() + first);
        });
        const double seconds = seconds_since(start);
        const auto count = static_cast<size_t>(rays.count);
        face.resize(count), distance.resize(count);
        return nb::make_tuple(seconds, to_numpy(face, {count}), to_numpy(distance, {count}));
    }

    // Traces rays with Embree's entry points for packets of `width` rays.
    nb::tuple trace_embree(nb::handle origins, nb::handle directions, float far, bool shadow, bool coherent,
                           int width) {
        const Columns rays(Vectors(origins, "origins"), Vectors(directions, "directions"), far);
        const auto count = static_cast<size_t>(rays.count);
        std::vector<int32_t> face(count);
        std::vector<float> distance(count);
        const auto run = width == 1    ? trace_packets<1>
                         : width == 4  ? trace_packets<4>
                         : width == 8  ? trace_packets<8>
                         : width == 16 ? trace_packets<16>
                                       : nullptr;
        if (!run) throw std::invalid_argument("width must be 1, 4, 8 or 16");
        const double seconds =
            run(api_, bvh_->handle(), threads_, rays, shadow, coherent, face.data(), distance.data());
        face.resize(count), distance.resize(count);
        return nb::make_tuple(seconds, to_numpy(face, {count}), to_numpy(distance, {count}));
    }

 private:
    const embree::Api& api_;
    int threads_;
    SceneTables tables_;
    std::unique_ptr<Bvh> bvh_;
    double build_seconds_ = 0.0;
};

}  // namespace

nb::tuple trace_rays(const Engine& engine, nb::handle origins, nb::handle directions, float far,
                     bool shadow) {
    const Columns rays(Vectors(origins, "origins"), Vectors(directions, "directions"), far);
    std::vector<int32_t> face(static_cast<size_t>(rays.padded));
    std::vector<float> distance(static_cast<size_t>(rays.padded));
    RayBatch batch{};
    for (int c = 0; c < 3; ++c) {
        batch.origin[c] = rays.value[c].data();
        batch.direction[c] = rays.value[3 + c].data();
    }
    batch.far = rays.value[6].data();
    batch.count = rays.padded;
    batch.shadow = shadow;
    engine.trace(batch, face.data(), distance.data());
    const auto count = static_cast<size_t>(rays.count);
    face.resize(count), distance.resize(count);
    return nb::make_tuple(to_numpy(face, {count}), to_numpy(distance, {count}));
}

void bind_rays(nb::module_& m) {
    nb::class_<RayScene>(m, "RayScene", "One mesh and its BVH, for measuring ray queries by themselves.")
        .def(nb::init<nb::handle, nb::handle, int, nb::handle>(), "vertices"_a, "faces"_a, "threads"_a,
             "embree"_a)
        .def_prop_ro("build_seconds", &RayScene::build_seconds)
        .def("refit", &RayScene::refit, "vertices"_a)
        .def("trace", &RayScene::trace, "origins"_a, "directions"_a, "far"_a, "shadow"_a, "coherent"_a,
             "brute_force"_a, "instruction_set"_a)
        .def("trace_embree", &RayScene::trace_embree, "origins"_a, "directions"_a, "far"_a, "shadow"_a,
             "coherent"_a, "width"_a);
}

}  // namespace edgegrad
