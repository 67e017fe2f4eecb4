// The faces that the camera sees nearly edge-on and that get samples by area (path/edge_on.h), and how many
// each gets.
#pragma once

#include "scene/tables.h"
#include "scene/view.h"
#include "tasks/render_options.h"

namespace edgegrad {

struct EdgeOnList {
    int64_t total = 0;  // samples; 0: there are no such faces
    // As in EdgeOnFaces.
    std::vector<int32_t> face_first, entry_instance;
    std::vector<float> entry_density;
    // As in EdgeOnTask: the parts of those faces in the frame, as triangles, sorted by place in the picture.
    std::vector<int32_t> segment_face, segment_instance;
    std::vector<float> corners;
    std::vector<double> cumulative;
};

// Those along which the camera's rays slide and that look different from place to place. `sides`:
// boundary/meshes/solids.h; `options`: of the interior term.
EdgeOnList edge_on_faces(const SceneView& scene, const SceneTables& tables, const std::vector<int8_t>& sides,
                         const RenderOptions& options, const RequestedMotion& motion, int threads);

}  // namespace edgegrad
