#include "boundary/specular/bounds.h"

#include <algorithm>
#include <cmath>

#include "boundary/curves/picture_frame.h"
#include "boundary/meshes/trees/placement.h"
#include "scene/mesh_instances.h"
#include "scene/sharp_lobes.h"

namespace edgegrad {
namespace {

// Allowance for rounding of projected points, pixels.
constexpr double kSlack = 0.5;

// Materials with mirrors, smooth glass, or lobes that scan lines follow.
std::vector<uint8_t> specular_materials(const SceneTables& t, float followed) {
    std::vector<uint8_t> out(t.material_first_closure.size() - 1);
    for (size_t m = 0; m < out.size(); ++m)
        out[m] = any_closure(t, m, [&](size_t closure) { return may_be_specular(t, closure, followed); });
    return out;
}

// The vertices of a mesh's faces with such materials; for a field, the corners of its box.
std::vector<int64_t> vertices_of(const SceneTables& t, size_t mesh, const std::vector<uint8_t>& materials) {
    const auto first = static_cast<size_t>(t.mesh_first_vertex[mesh]);
    std::vector<uint8_t> used(static_cast<size_t>(t.mesh_first_vertex[mesh + 1]) - first);
    const auto last_face = static_cast<size_t>(t.mesh_first_face[mesh + 1]);
    for (auto face = static_cast<size_t>(t.mesh_first_face[mesh]); face < last_face; ++face)
        if (materials[static_cast<size_t>(t.face_material[face])])
            for (size_t c = 0; c < 3; ++c) used[static_cast<size_t>(t.faces[3 * face + c]) - first] = 1;
    if (static_cast<int32_t>(mesh) >= t.first_field() && used[0])
        std::fill(used.begin(), used.end(), uint8_t{1});
    std::vector<int64_t> out;
    for (size_t k = 0; k < used.size(); ++k)
        if (used[k]) out.push_back(static_cast<int64_t>(first + k));
    return out;
}

}  // namespace

FilmRectangle specular_bounds(const SceneView& scene, const SceneTables& t) {
    const CameraView& c = scene.camera;
    const PictureFrame frame(c);
    const auto margin = static_cast<float>(frame.margin());
    const FilmRectangle all{{-margin, -margin},
                            {static_cast<float>(c.width) + margin, static_cast<float>(c.height) + margin}};
    const std::vector<uint8_t> materials = specular_materials(t, scene.followed_alpha);
    double low[2] = {1e30, 1e30}, high[2] = {-1e30, -1e30};
    // Adds the projections of vertices. False if they may be seen anywhere.
    const auto add = [&](const std::vector<int64_t>& vertices, int32_t instance) {
        const Placement placed = Placement::of(scene, instance);
        for (int64_t k : vertices) {
            const auto seen = frame.around(placed(vertex(scene, k)));
            if (!seen) return false;
            for (int axis = 0; axis < 2; ++axis) {
                low[axis] = std::min(low[axis], seen->low[axis] - kSlack);
                high[axis] = std::max(high[axis], seen->high[axis] + kSlack);
            }
        }
        return true;
    };
    const auto instances = mesh_instances(t);
    for (size_t mesh = 0; mesh < instances.size(); ++mesh) {
        const std::vector<int64_t> vertices = vertices_of(t, mesh, materials);
        for (int32_t instance : instances[mesh])
            if (!add(vertices, instance)) return all;
    }
    FilmRectangle out = all;
    for (int axis = 0; axis < 2; ++axis) {
        const double from = all.low[axis], to = all.high[axis];
        out.low[axis] = static_cast<float>(std::clamp(std::floor(low[axis]), from, to));
        out.high[axis] = static_cast<float>(std::clamp(std::ceil(high[axis]), from, to));
    }
    return out;
}

}  // namespace edgegrad
