// Everything that gives light, in the form that kernels pick from: emissive faces and the light table's rows.
#pragma once

#include <vector>

#include "scene/lights/light_view.h"
#include "scene/tables.h"

namespace edgegrad {

// Beyond this many lights of finite distance a hierarchy finds one faster than a look at each.
constexpr size_t kMostFlatLights = 32;

class LightList {
 public:
    // `dark_too`: what is dark, but said to give light (a row of the table, a shader flagged as emissive), is
    // picked as if it were dim. Its strength has a derivative.
    explicit LightList(const SceneTables& tables, bool dark_too = false);
    // Of some rows of the table alone, dark ones too.
    LightList(const SceneTables& tables, const std::vector<uint8_t>& rows);

    // Points into the list and the tables: both must outlive it.
    const LightView& view() const { return view_; }
    // By node on top of the view: the mesh all of whose lights are faces of it; -1: there is none.
    const std::vector<int32_t>& top_mesh() const { return top_mesh_; }

 private:
    void add_faces(const SceneTables& tables);
    // Of `which` rows; null: of all.
    void add_rows(const SceneTables& tables, bool dark_too, const std::vector<uint8_t>* which = nullptr);
    void lift_dark(const SceneTables& tables);
    void arrange();

    struct Light {
        int32_t kind, index;
        LightNode node;
        double area;   // of a face; of a row 0
        int32_t mesh;  // of a face; of a row -1
    };
    std::vector<Light> near_, distant_;
    std::vector<int32_t> kind_, index_, node_of_, face_light_, light_of_row_, sized_, top_mesh_;
    std::vector<LightNode> nodes_;
    LightView view_{};
};

}  // namespace edgegrad
