// The faces that the camera sees nearly edge-on, on which samples by area are worth their while
// (path/edge_on.h), and how many each gets.
#pragma once

#include "engine/engine.h"

namespace edgegrad {

struct EdgeOnList {
    int64_t total = 0;  // samples; 0: there are no such faces
    // As in EdgeOnFaces.
    std::vector<int32_t> face_first, entry_instance;
    std::vector<float> entry_density;
    // Pieces, as in EdgeOnTask: what is in the frame of those faces, as triangles, by place in the picture.
    std::vector<int32_t> segment_face, segment_instance;
    std::vector<float> corners;
    std::vector<double> cumulative;
};

// Those on which the camera's rays slide along what looks different from place to place. `sides`:
// boundary/meshes/solids.h; `options`: of the interior term.
EdgeOnList edge_on_faces(const SceneView& scene, const SceneTables& tables, const std::vector<int8_t>& sides,
                         const RenderOptions& options, const RequestedMotion& motion, int threads);

}  // namespace edgegrad
