// The faces that the camera sees nearly edge-on, and the number of samples by area (path/edge_on.h) of each.
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
    // As in EdgeOnTask: the parts of those faces inside the frame, as triangles sorted by place in the
    // picture.
    std::vector<int32_t> segment_face, segment_instance;
    std::vector<float> corners;
    std::vector<double> cumulative;
};

// Finds such faces, if the hits of camera rays move along them and their radiance varies over the face.
// `sides`: boundary/meshes/solids.h; `options`: those of the interior term.
EdgeOnList edge_on_faces(const SceneView& scene, const SceneTables& tables, const std::vector<int8_t>& sides,
                         const RenderOptions& options, const RequestedMotion& motion, int threads);

// Whether radiance may vary within a face, in a picture that has edge-on faces. Otherwise the motion of hits
// along a face changes nothing: direct light of the environment is constant over a flat face.
bool edge_on_matters(const SceneView& scene, const RenderOptions& options);

// If they matter: whether there are such faces.
bool any_edge_on_face(const SceneView& scene, const SceneTables& tables, const std::vector<int8_t>& sides,
                      const RequestedMotion& motion, int threads);

}  // namespace edgegrad
