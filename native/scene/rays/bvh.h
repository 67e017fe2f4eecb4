// Embree's scene of the meshes that rays can hit.
#pragma once

#include "scene/tables.h"
#include "sdf/bricks/bricks.h"

namespace edgegrad {

class Bvh {
 public:
    // Shares the tables' vertices, faces and coefficients of fields, which must not move in memory. The
    // vertices need four floats of padding at their end, because Embree reads 16 bytes at each.
    Bvh(const embree::Api& api, const SceneTables& tables, int threads);
    ~Bvh();
    Bvh(const Bvh&) = delete;
    Bvh& operator=(const Bvh&) = delete;

    // A change of a field in place: of blocks of its coefficients (sdf/bricks/coefficient_blocks.h; empty: of
    // none), or of its transform.
    struct ChangedField {
        int32_t field;
        std::vector<uint8_t> blocks;
        bool placed;
    };
    // Updates the BVH after vertices of these meshes have moved in place, and fields have changed. `far`: too
    // far for refitting.
    void update(const SceneTables& tables, const std::vector<int32_t>& moved, bool far,
                const std::vector<ChangedField>& fields = {});

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
    embree::Geometry new_mesh(const SceneTables& tables, int32_t mesh);
    embree::Geometry new_field(const SceneTables& tables, size_t field);
    void find_bricks(const SceneTables& tables, const ChangedField& changed);
    void make_dynamic();
    void release();
    void check(const char* doing);

    const embree::Api& api_;
    int threads_;
    embree::Device device_ = nullptr;
    embree::SceneHandle scene_ = nullptr;
    std::vector<embree::Geometry> geometries_, instances_;
    std::vector<Instanced> instanced_;
    std::vector<TracedField> fields_;
    bool dynamic_ = false;
    // Embree would free some memory twice if it were released after it ran out of memory.
    bool abandoned_ = false;
};

}  // namespace edgegrad
