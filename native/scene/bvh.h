// Embree's scene over the meshes that rays can hit.
#pragma once

#include "scene/tables.h"

namespace edgegrad {

class Bvh {
 public:
    // Shares the tables' vertices and faces, which must stay where they are; the vertices need four
    // floats of padding behind their end (Embree reads 16 bytes at each).
    Bvh(const embree::Api& api, const SceneTables& tables, int threads);
    ~Bvh() { release(); }
    Bvh(const Bvh&) = delete;
    Bvh& operator=(const Bvh&) = delete;

    // After vertices of these meshes have moved in place.
    void update(const SceneTables& tables, const std::vector<int32_t>& moved);

    embree::SceneHandle handle() const { return scene_; }

 private:
    void build(const SceneTables& tables);
    void release();
    void check(const char* doing) const;

    const embree::Api& api_;
    embree::Device device_ = nullptr;
    embree::SceneHandle scene_ = nullptr;
    std::vector<embree::Geometry> geometries_;
    std::vector<float> built_vertices_;  // where they were when built from scratch
    bool dynamic_ = false;
};

}  // namespace edgegrad
