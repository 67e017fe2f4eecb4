#include "scene/bvh.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <stdexcept>
#include <string>

namespace edgegrad {
namespace {

// A mesh that has moved by more than this share of its size since its BVH was built is built anew:
// refitted boxes of far-moved triangles overlap, and traversal slows down.
constexpr double kRebuildMotion = 0.05;
constexpr int kErrorOutOfMemory = 4;  // RTC_ERROR_OUT_OF_MEMORY

}  // namespace

Bvh::Bvh(const embree::Api& api, const SceneTables& tables, int threads) : api_(api) {
    const std::string config = "threads=" + std::to_string(threads);
    device_ = api_.new_device(config.c_str());
    if (!device_) throw std::runtime_error("Embree can't create a device");
    try {
        build(tables);
    } catch (...) {
        release();
        throw;
    }
}

void Bvh::release() {
    for (embree::Geometry g : geometries_) api_.release_geometry(g);
    geometries_.clear();
    if (scene_) api_.release_scene(scene_);
    scene_ = nullptr;
    if (device_) api_.release_device(device_);
    device_ = nullptr;
}

void Bvh::check(const char* doing) const {
    const int error = api_.device_error(device_);
    if (error == 0) return;
    if (error == kErrorOutOfMemory) throw std::bad_alloc();
    throw std::runtime_error(std::string("Embree failed while ") + doing + " (error " +
                             std::to_string(error) + ")");
}

void Bvh::build(const SceneTables& tables) {
    scene_ = api_.new_scene(device_);
    api_.set_scene_quality(scene_, embree::kMedium);
    for (int32_t m = 0; m < tables.visible_meshes; ++m) {
        embree::Geometry g = api_.new_geometry(device_, embree::kTriangle);
        geometries_.push_back(g);
        const size_t vertices = static_cast<size_t>(tables.mesh_first_vertex[m + 1]);
        const size_t first = static_cast<size_t>(tables.mesh_first_face[m]);
        const size_t faces = static_cast<size_t>(tables.mesh_first_face[m + 1]) - first;
        api_.set_shared_buffer(g, embree::kVertexBuffer, 0, embree::kFloat3, tables.vertices.data(), 0, 12,
                               vertices);
        api_.set_shared_buffer(g, embree::kIndexBuffer, 0, embree::kUInt3, tables.faces.data(), 12 * first,
                               12, faces);
        api_.enable_argument_filter(g, true);
        api_.commit_geometry(g);
        api_.attach_geometry_by_id(scene_, g, static_cast<unsigned>(m));
    }
    api_.commit_scene(scene_);
    check("building the BVH");
    built_vertices_ = tables.vertices;
}

void Bvh::update(const SceneTables& tables, const std::vector<int32_t>& moved) {
    if (moved.empty()) return;
    bool far = false;
    for (int32_t m : moved) {
        const size_t first = 3 * static_cast<size_t>(tables.mesh_first_vertex[m]);
        const size_t last = 3 * static_cast<size_t>(tables.mesh_first_vertex[m + 1]);
        double motion = 0.0, low = 1e300, high = -1e300;
        for (size_t k = first; k < last; ++k) {
            const double x = tables.vertices[k];
            motion = std::max(motion, std::abs(x - built_vertices_[k]));
            low = std::min(low, x);
            high = std::max(high, x);
        }
        far = far || motion > kRebuildMotion * (high - low);
    }
    // A scene that never moves has one BVH over all meshes, which is the fastest to trace. From the
    // first motion on it is dynamic: one BVH per mesh, so that only what moved is refitted.
    const bool rebuild = far || !dynamic_;
    if (!dynamic_) {
        api_.set_scene_flags(scene_, embree::kDynamic);
        dynamic_ = true;
    }
    if (rebuild) {
        built_vertices_ = tables.vertices;
        for (embree::Geometry g : geometries_) {
            api_.set_geometry_quality(g, embree::kMedium);
            api_.update_buffer(g, embree::kVertexBuffer, 0);
            api_.commit_geometry(g);
        }
    } else {
        for (int32_t m : moved) {
            api_.set_geometry_quality(geometries_[static_cast<size_t>(m)], embree::kRefit);
            api_.update_buffer(geometries_[static_cast<size_t>(m)], embree::kVertexBuffer, 0);
            api_.commit_geometry(geometries_[static_cast<size_t>(m)]);
        }
    }
    api_.commit_scene(scene_);
    check("updating the BVH");
}

}  // namespace edgegrad
