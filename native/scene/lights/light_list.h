// All light sources in the form from which kernels choose: emissive faces and rows of the light table.
#pragma once

#include <vector>

#include "scene/lights/light_view.h"
#include "scene/tables.h"

namespace edgegrad {

// From this number of lights at finite distance on, a hierarchy is faster than comparing all of them.
constexpr size_t kMostFlatLights = 32;

class LightList {
 public:
    // `dark_too`: dark lights (rows of the table, closures flagged as emissive) are chosen as if they were
    // dim, because their strength has a derivative.
    explicit LightList(const SceneTables& tables, bool dark_too = false);
    // Some rows of the table only, dark ones included.
    LightList(const SceneTables& tables, const std::vector<uint8_t>& rows);

    // A view of the list and the tables, which must outlive it.
    const LightView& view() const { return view_; }
    // For each top node of the view: the mesh that all of its lights belong to; -1: none.
    const std::vector<int32_t>& top_mesh() const { return top_mesh_; }

 private:
    void add_faces(const SceneTables& tables);
    // Adds the rows in `which`; null: all.
    void add_rows(const SceneTables& tables, bool dark_too, const std::vector<uint8_t>* which = nullptr);
    void lift_dark(const SceneTables& tables);
    void arrange();

    struct Light {
        int32_t kind, index;
        LightNode node;
        double area;   // of a face; 0 for a row
        int32_t mesh;  // of a face; -1 for a row
    };
    std::vector<Light> near_, distant_;
    std::vector<int32_t> kind_, index_, node_of_, face_light_, light_of_row_, sized_, top_mesh_;
    std::vector<LightNode> nodes_;
    LightView view_{};
};

}  // namespace edgegrad
