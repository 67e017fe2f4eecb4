// The scene as kernels see it in one call: the tables, and values that the call adds.
#pragma once

#include <memory>

#include "engine/decisions/followed_lobes_rule.h"
#include "scene/lights/light_list.h"
#include "scene/rays/brute_triangles.h"
#include "scene/rays/bvh.h"

namespace edgegrad {

struct ContactMaterials;
struct CoplanarPolygons;
struct EdgeCache;
struct MaterialJumps;

class PreparedScene {
 public:
    // `lights`: the lights that the call samples. `motion`: the requested motion; null: a picture.
    // `followed`: limits of followed lobes. Without a `bvh` (null) no ray can be traced. `kept`:
    // cached searches for edges, which derivatives need. `filter_glossy`: Cycles' Filter Glossy
    // (shading/bsdf/filter_glossy.h).
    PreparedScene(const embree::Api& api, const Bvh* bvh, const SceneTables& tables,
                  const RequestedMotion* motion, bool convex, std::shared_ptr<const LightList> lights,
                  float filter_glossy = 0.0f, FollowedAlpha followed = {}, EdgeCache* kept = nullptr,
                  std::vector<FieldBand> bands = {});

    const SceneView& view() const { return view_; }

 private:
    void hold_directions(const SceneTables& tables, const RequestedMotion& motion);
    // Where the direction of light is fixed near contact (scene/contact.h).
    void blend_near_contact(const SceneTables& tables, const RequestedMotion& motion, EdgeCache& kept);

    std::shared_ptr<const LightList> lights_;
    const FollowedAlpha followed_;
    std::vector<BruteTriangle> brute_triangles_;
    std::vector<FieldView> fields_;
    std::vector<FieldBand> field_bands_;
    std::vector<int32_t> face_moving_, face_fixed_direction_, material_fixed_direction_;
    std::shared_ptr<const std::vector<int32_t>> mesh_contact_;
    std::shared_ptr<const std::vector<float>> transparent_boxes_, mesh_size_;
    std::shared_ptr<const CoplanarPolygons> polygons_;
    std::shared_ptr<const ContactMaterials> contact_materials_;
    std::shared_ptr<const MaterialJumps> jumps_;
    SceneView view_{};
};

}  // namespace edgegrad
