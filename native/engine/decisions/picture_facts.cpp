#include "engine/decisions/picture_facts.h"

namespace edgegrad {

PictureFacts picture_facts(const SceneView& scene, const SceneTables& tables) {
    PictureFacts out;
    out.triangles = tables.mesh_first_face[static_cast<size_t>(tables.first_field())];
    out.instances = static_cast<int64_t>(tables.instance_mesh.size());
    out.transparent = scene.all_flags & kHasTransparency;
    out.lambertian = scene.common_flags & kLambertian;
    out.glossy = scene.all_flags & kHasGlossy;
    out.refracting = scene.all_flags & kHasRefraction;
    out.flat = tables.fields.empty() && !scene.corner_normal && !(scene.all_flags & kHasNormalMap);
    for (size_t row = 0; row < tables.material_used.size(); ++row)
        if (tables.material_used[row]) out.material_rows.push_back(static_cast<int32_t>(row));
    for (int32_t light = 0; light < scene.lights.count; ++light)
        if (scene.lights.kind[light] == kTriangleLight)
            ++out.emissive_triangles;
        else
            out.sampled_rows.push_back(scene.lights.index[light]);
    out.environment = scene.has_environment;
    out.environment_image = scene.environment_image.pixels;
    out.media = scene.any_medium;
    return out;
}

}  // namespace edgegrad
