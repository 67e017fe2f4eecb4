// Embree's scene of the meshes that rays can hit.
#pragma once

#include "scene/tables.h"

namespace edgegrad {

class Bvh {
 public:
    // Shares the tables' vertices and faces, which must not move in memory. The vertices need four floats of
    // padding at their end, because Embree reads 16 bytes at each.
    Bvh(const embree::Api& api, const SceneTables& tables, int threads);
    ~Bvh() { release(); }
    Bvh(const Bvh&) = delete;
    Bvh& operator=(const Bvh&) = delete;

    // Updates the BVH after vertices of these meshes have moved in place. `far`: too far for refitting.
    void update(const SceneTables& tables, const std::vector<int32_t>& moved, bool far);

    embree::SceneHandle handle() const { return scene_; }

 private:
    // Geometry m of `geometries_` is mesh m. An instanced mesh has a scene of its own, of which instance i is
    // geometry (number of meshes + i) of the main scene.
    struct Instanced {
        int32_t mesh;
        embree::SceneHandle scene;
    };

    void build(const SceneTables& tables);
    void build_instances(const SceneTables& tables);
    void make_dynamic();
    void release();
    void check(const char* doing);

    const embree::Api& api_;
    embree::Device device_ = nullptr;
    embree::SceneHandle scene_ = nullptr;
    std::vector<embree::Geometry> geometries_, instances_;
    std::vector<Instanced> instanced_;
    bool dynamic_ = false;
    // Embree would free some memory twice if it were released after it ran out of memory.
    bool abandoned_ = false;
};

}  // namespace edgegrad
