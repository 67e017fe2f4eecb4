// The tables as kernels see them for one call, with what the call adds to them.
#pragma once

#include <memory>
#include <optional>

#include "scene/brute_triangles.h"
#include "scene/bvh.h"
#include "scene/emitter_table.h"
#include "scene/light_list.h"

namespace edgegrad {

class PreparedScene {
 public:
    // For derivatives that are `asked` for, or for the picture with its `lights`; the other is null.
    PreparedScene(const embree::Api& api, const Bvh& bvh, const SceneTables& tables, const Asked* asked,
                  bool convex, std::shared_ptr<const LightList> lights = nullptr);

    const SceneView& view() const { return view_; }
    int64_t edge_count() const { return edge_count_; }

 private:
    std::optional<EmitterTable> emitters_;
    std::shared_ptr<const LightList> lights_;
    std::vector<BruteTriangle> brute_triangles_;
    std::vector<int32_t> face_moving_;
    int64_t edge_count_;
    SceneView view_{};
};

}  // namespace edgegrad
