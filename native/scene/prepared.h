// The tables as kernels see them for one call, with what the call adds to them.
#pragma once

#include <optional>

#include "scene/bvh.h"
#include "scene/emitter_table.h"
#include "scene/light_list.h"

namespace edgegrad {

class PreparedScene {
 public:
    // `asked` null: for the picture alone.
    PreparedScene(const embree::Api& api, const Bvh& bvh, const SceneTables& tables, const Asked* asked,
                  bool convex);

    const SceneView& view() const { return view_; }
    int64_t edge_count() const { return edge_count_; }

 private:
    EmitterTable emitters_;
    std::optional<LightList> lights_;  // of pictures
    std::vector<int32_t> face_moving_;
    int64_t edge_count_;
    SceneView view_{};
};

}  // namespace edgegrad
