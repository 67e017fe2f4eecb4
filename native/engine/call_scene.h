// The tables as kernels see them for one call, with what the call adds to them.
#pragma once

#include <memory>

#include "scene/lights/light_list.h"
#include "scene/rays/brute_triangles.h"
#include "scene/rays/bvh.h"

namespace edgegrad {

struct CoplanarPolygons;
struct EdgeCache;

class PreparedScene {
 public:
    // With the picture's `lights`, and what estimators of `asked` derivatives have beside them (null: none),
    // which follow lobes up to an alpha of `followed`. Without a `bvh` (null) no ray can be traced. `kept`:
    // what is known about edges, for estimators alone.
    PreparedScene(const embree::Api& api, const Bvh* bvh, const SceneTables& tables,
                  const RequestedMotion* motion, bool convex, std::shared_ptr<const LightList> lights,
                  float followed = 0.0f, EdgeCache* kept = nullptr);

    const SceneView& view() const { return view_; }

 private:
    void hold_directions(const SceneTables& tables, const RequestedMotion& motion);
    // Where the direction of light is fixed near contact (scene/contact.h).
    void blend_near_contact(const SceneTables& tables, const RequestedMotion& motion, EdgeCache& kept);

    std::shared_ptr<const LightList> lights_;
    std::vector<BruteTriangle> brute_triangles_;
    std::vector<FieldView> fields_;
    std::vector<int32_t> face_moving_, face_held_, material_held_, mesh_contact_;
    std::vector<float> transparent_boxes_;
    std::shared_ptr<const CoplanarPolygons> polygons_;
    SceneView view_{};
};

}  // namespace edgegrad
