#include "scene/rays/bvh.h"

#include <algorithm>
#include <fstream>
#include <new>
#include <stdexcept>
#include <string>

#include "embree/library.h"
#include "scene/mesh_instances.h"

namespace edgegrad {
namespace {

// Peak memory of a build, by face, and of Embree itself with its threads' stacks. Smaller values risk running
// out of memory within Embree, larger ones refuse scenes that would fit.
constexpr size_t kBuildBytesPerFace = 250;
constexpr size_t kDeviceBytes = size_t{96} << 20;

// Throws std::bad_alloc if there is no room for a build. Embree may wait forever if one of its threads runs
// out of memory during a build.
void check_room(size_t faces) {
    const size_t needed = kDeviceBytes + faces * kBuildBytesPerFace;
    ::operator delete(::operator new(needed));
    std::ifstream memory("/proc/meminfo");  // where the system promises more memory than it has
    std::string name;
    size_t kilobytes;
    while (memory >> name >> kilobytes) {
        if (name == "MemAvailable:" && needed > kilobytes * 1024) throw std::bad_alloc();
        memory.ignore(64, '\n');
    }
}

}  // namespace

Bvh::Bvh(const embree::Api& api, const SceneTables& tables, int threads) : api_(api), threads_(threads) {
    check_room(tables.faces.size() / 3);
    device_ = embree::device(threads);
    api_.device_error(device_);  // clears an error that an earlier call has left
    try {
        build(tables);
    } catch (...) {
        release();
        throw;
    }
}

Bvh::~Bvh() { release(); }

void Bvh::release() {
    if (abandoned_) return;
    for (embree::Geometry g : instances_) api_.release_geometry(g);
    for (embree::Geometry g : geometries_) api_.release_geometry(g);
    for (const Instanced& i : instanced_) api_.release_scene(i.scene);
    instances_.clear();
    geometries_.clear();
    instanced_.clear();
    if (scene_) api_.release_scene(scene_);
    scene_ = nullptr;
}

void Bvh::check(const char* doing) {
    const int error = api_.device_error(device_);
    if (error == 0) return;
    abandoned_ = true;
    if (error == embree::kErrorOutOfMemory) throw std::bad_alloc();
    throw std::runtime_error(std::string("Embree failed while ") + doing + " (error " +
                             std::to_string(error) + ")");
}

void Bvh::build(const SceneTables& tables) {
    scene_ = api_.new_scene(device_);
    api_.set_scene_quality(scene_, embree::kMedium);
    const auto instances = mesh_instances(tables);
    // Reserve first: an exception between creating an Embree object and storing it would leak it.
    geometries_.reserve(static_cast<size_t>(tables.visible_meshes));
    fields_.resize(tables.fields.size());  // callbacks have their addresses
    instanced_.reserve(static_cast<size_t>(tables.visible_meshes));
    instances_.reserve(tables.instance_mesh.size());
    for (int32_t m = 0; m < tables.visible_meshes; ++m) {
        const embree::Geometry g = m < tables.first_field()
                                       ? new_mesh(tables, m)
                                       : new_field(tables, static_cast<size_t>(m - tables.first_field()));
        api_.enable_argument_filter(g, true);
        api_.set_geometry_mask(g, static_cast<unsigned>(tables.mesh_mask[m]));
        api_.commit_geometry(g);
        embree::SceneHandle parent = scene_;
        if (is_placed(instances[static_cast<size_t>(m)])) {
            parent = api_.new_scene(device_);
            instanced_.push_back({m, parent});
        }
        api_.attach_geometry_by_id(parent, g, static_cast<unsigned>(m));
    }
    build_instances(tables);
    embree::commit_scene(scene_);
    check("building the BVH");
}

embree::Geometry Bvh::new_mesh(const SceneTables& tables, int32_t mesh) {
    embree::Geometry g = api_.new_geometry(device_, embree::kTriangle);
    geometries_.push_back(g);
    const size_t vertices = static_cast<size_t>(tables.mesh_first_vertex[mesh + 1]);
    const size_t first = static_cast<size_t>(tables.mesh_first_face[mesh]);
    const size_t faces = static_cast<size_t>(tables.mesh_first_face[mesh + 1]) - first;
    api_.set_shared_buffer(g, embree::kVertexBuffer, 0, embree::kFloat3, tables.vertices.data(), 0, 12,
                           vertices);
    api_.set_shared_buffer(g, embree::kIndexBuffer, 0, embree::kUInt3, tables.faces.data(), 12 * first, 12,
                           faces);
    return g;
}

// The primitives of a field are its bricks; queries bring the functions that intersect them.
embree::Geometry Bvh::new_field(const SceneTables& tables, size_t field) {
    TracedField& f = fields_[field];
    f.set_view(tables.fields[field].view());
    f.find_bricks({}, threads_);
    embree::Geometry g = api_.new_geometry(device_, embree::kUser);
    geometries_.push_back(g);
    api_.set_primitive_count(g, static_cast<unsigned>(f.bricks.size()));
    api_.set_user_data(g, &f);
    const auto bounds = [](const embree::BoundsArguments* args) {
        static_cast<const TracedField*>(args->user)->bounds(args->primitive, *args->bounds);
    };
    api_.set_bounds_function(g, bounds, nullptr);
    return g;
}

// Bricks are primitives: if others than before may have the surface, the field's BVH is built again.
void Bvh::find_bricks(const SceneTables& tables, const ChangedField& changed) {
    TracedField& f = fields_[static_cast<size_t>(changed.field)];
    f.set_view(tables.fields[static_cast<size_t>(changed.field)].view());
    const size_t before = f.bricks.size();
    if (!changed.blocks.empty()) f.find_bricks(changed.blocks, threads_);
    const embree::Geometry g = geometries_[static_cast<size_t>(tables.first_field() + changed.field)];
    const bool refit = f.bricks.size() == before && !changed.placed;
    api_.set_geometry_quality(g, refit ? embree::kRefit : embree::kMedium);
    api_.set_primitive_count(g, static_cast<unsigned>(f.bricks.size()));
    api_.commit_geometry(g);
}

void Bvh::build_instances(const SceneTables& tables) {
    for (const Instanced& i : instanced_) embree::commit_scene(i.scene);
    for (size_t k = 0; k < tables.instance_mesh.size(); ++k) {
        const int32_t mesh = tables.instance_mesh[k];
        const auto of = std::find_if(instanced_.begin(), instanced_.end(),
                                     [&](const Instanced& i) { return i.mesh == mesh; });
        embree::Geometry g = api_.new_geometry(device_, embree::kInstance);
        instances_.push_back(g);
        api_.set_instanced_scene(g, of->scene);
        api_.set_transform(g, 0, embree::kFloat3x4RowMajor, &tables.instance_to_world[12 * k]);
        api_.set_geometry_mask(g, static_cast<unsigned>(tables.mesh_mask[static_cast<size_t>(mesh)]));
        api_.enable_argument_filter(g, true);
        api_.commit_geometry(g);
        api_.attach_geometry_by_id(scene_, g,
                                   static_cast<unsigned>(tables.visible_meshes) + static_cast<unsigned>(k));
    }
}

void Bvh::make_dynamic() {
    if (dynamic_) return;
    // Embree keeps one BVH per mesh, which can be refitted, only in scenes of low quality. Each mesh's own
    // BVH is built with its own quality.
    const auto prepare = [&](embree::SceneHandle scene) {
        api_.set_scene_flags(scene, embree::kDynamic);
        api_.set_scene_quality(scene, embree::kLow);
    };
    prepare(scene_);
    for (const Instanced& i : instanced_) prepare(i.scene);
    dynamic_ = true;
}

void Bvh::update(const SceneTables& tables, const std::vector<int32_t>& moved, bool far,
                 const std::vector<ChangedField>& fields) {
    if (moved.empty() && fields.empty()) return;
    api_.device_error(device_);
    // A scene that never moves has one BVH over all meshes, which is fastest to trace. From the first motion
    // on the scene is dynamic: one BVH per mesh, so that only moved meshes are refitted.
    const bool rebuild = far || !dynamic_;
    make_dynamic();
    const auto commit = [&](int32_t m, embree::Quality quality) {
        embree::Geometry g = geometries_[static_cast<size_t>(m)];
        api_.set_geometry_quality(g, quality);
        api_.update_buffer(g, embree::kVertexBuffer, 0);
        api_.commit_geometry(g);
    };
    if (rebuild) {
        for (int32_t m = 0; m < tables.first_field(); ++m) commit(m, embree::kMedium);
    } else {
        for (int32_t m : moved) commit(m, embree::kRefit);
    }
    for (int32_t m = tables.first_field(); rebuild && m < tables.visible_meshes; ++m) {
        api_.set_geometry_quality(geometries_[static_cast<size_t>(m)], embree::kMedium);
        api_.commit_geometry(geometries_[static_cast<size_t>(m)]);
    }
    for (const ChangedField& changed : fields) find_bricks(tables, changed);
    for (const Instanced& i : instanced_)
        if (rebuild || std::find(moved.begin(), moved.end(), i.mesh) != moved.end())
            embree::commit_scene(i.scene);
    if (rebuild || !instanced_.empty())
        for (embree::Geometry g : instances_) api_.commit_geometry(g);
    embree::commit_scene(scene_);
    check("updating the BVH");
}

}  // namespace edgegrad
