// The facts by which kernels skip work in pictures of a scene, as data that core/planning puts into words.
#pragma once

#include <vector>

#include "scene/tables.h"
#include "scene/view.h"

namespace edgegrad {

struct PictureFacts {
    int64_t triangles = 0;  // of meshes and of the originals of instances
    int64_t instances = 0;  // traced in place
    bool transparent = false, lambertian = false, glossy = false, refracting = false;
    bool flat = false;                   // no shading normals are interpolated or mapped
    std::vector<int32_t> material_rows;  // of visible faces and fields
    int64_t emissive_triangles = 0;      // sampled as lights
    std::vector<int32_t> sampled_rows;   // of the light table
    bool environment = false, environment_image = false;
    bool media = false;  // scatter or absorb light (shading/media.h)
};

PictureFacts picture_facts(const SceneView& scene, const SceneTables& tables);

}  // namespace edgegrad
