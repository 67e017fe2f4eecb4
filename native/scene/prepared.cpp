#include "scene/prepared.h"

#include <algorithm>

namespace edgegrad {

PreparedScene::PreparedScene(const embree::Api& api, const Bvh& bvh, const SceneTables& tables,
                             const Asked* asked, bool convex)
    : emitters_(tables, asked),
      face_moving_(tables.face_material.size(), 0),
      edge_count_(static_cast<int64_t>(tables.edge_vertices.size() / 2)) {
    for (size_t m = 0; asked && m < asked->moving.size(); ++m)
        if (asked->moving[m])
            std::fill(face_moving_.begin() + tables.mesh_first_face[m],
                      face_moving_.begin() + tables.mesh_first_face[m + 1], 1);
    view_.api = &api;
    view_.convex = convex;
    view_.bvh = bvh.handle();
    view_.vertices = tables.vertices.data();
    view_.faces = tables.faces.data();
    view_.face_material = tables.face_material.data();
    view_.face_moving = face_moving_.data();
    view_.mesh_first_face = tables.mesh_first_face.data();
    view_.albedo = tables.albedo.data();
    view_.emission = tables.emission.data();
    view_.emission_two_sided = tables.emission_two_sided.data();
    view_.any_emission =
        std::any_of(tables.emission.begin(), tables.emission.end(), [](float e) { return e > 0.0f; });
    view_.emitter_count = static_cast<int32_t>(emitters_.kind.size());
    view_.emitter_kind = emitters_.kind.data();
    view_.emitter_index = emitters_.index.data();
    view_.emitter_cdf = emitters_.cdf.data();
    view_.point_position = tables.point_position.data();
    view_.point_intensity = tables.point_intensity.data();
    view_.sun_direction = tables.sun_direction.data();
    view_.sun_irradiance = tables.sun_irradiance.data();
    std::copy_n(tables.environment, 3, view_.environment);
    view_.has_environment =
        (asked && asked->environment) ||
        std::any_of(view_.environment, view_.environment + 3, [](float e) { return e > 0.0f; });
    view_.edge_vertices = tables.edge_vertices.data();
    view_.edge_face_first = tables.edge_face_first.data();
    view_.edge_faces = tables.edge_faces.data();
    view_.edge_opposite = tables.edge_opposite.data();
    view_.camera = tables.camera;
}

}  // namespace edgegrad
