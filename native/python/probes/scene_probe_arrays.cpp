// Derivatives of parts of the shading code that read a scene. The scene is given by arrays, without a BVH.
#include "python/probes/probe_arrays.h"

#include <algorithm>
#include <stdexcept>

#include "kernels/dispatch.h"
#include "python/bindings.h"
#include "python/numpy_arrays.h"
#include "python/textures.h"
#include "tasks/kernel_table.h"
#include "tasks/probe_tasks.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace edgegrad {

namespace {

// The arrays are named as in SceneView. `camera` is the row of kCameraFloats. `camera_sizes` is its kind, the
// width and height of the full picture, the window's first pixel, and the number of blades.
// `environment_size` is width and height.
class Scene {
 public:
    Scene(nb::handle s, nb::handle probe)
        : vertices(column<float>(s, "vertices")),
          normals(column<float>(s, "normals")),
          instance_to_world(column<float>(s, "instance_to_world")),
          light_params(column<float>(s, "light_params")),
          environment_pixels(column<float>(s, "environment_pixels")),
          a(column<float>(probe, "a")),
          b(column<float>(probe, "b")),
          faces_(column<int32_t>(s, "faces")),
          corner_normal_(column<int32_t>(s, "corner_normal")),
          face_material_(column<int32_t>(s, "face_material")),
          light_flags_(column<int32_t>(s, "light_flags")),
          index_(column<int32_t>(probe, "index")),
          instance_(column<int32_t>(probe, "instance")),
          textures_(read_textures(s.attr("textures"))) {
        view_.vertices = vertices.data();
        view_.normals = normals.data();
        view_.instance_to_world = instance_to_world.data();
        view_.faces = faces_.data();
        view_.corner_normal = corner_normal_.empty() ? nullptr : corner_normal_.data();
        view_.face_material = face_material_.data();
        view_.lights.params = light_params.data();
        view_.lights.flags = light_flags_.data();
        view_.textures = textures_.view();
        const auto sizes = column<int32_t>(s, "camera_sizes"), image = column<int32_t>(s, "environment_size");
        const auto camera = column<float>(s, "camera"), environment = column<float>(s, "environment"),
                   rotation = column<float>(s, "environment_rotation");
        const size_t n = index_.size();
        if (camera.size() != kCameraFloats || environment.size() != 3 || rotation.size() != 9 ||
            sizes.size() != 6 || image.size() != 2 || instance_.size() != n || a.size() != 3 * n ||
            b.size() != 3 * n)
            throw std::invalid_argument("the probe's arrays have sizes that disagree");
        view_.environment_image.pixels = environment_pixels.empty() ? nullptr : environment_pixels.data();
        view_.environment_image.width = image[0], view_.environment_image.height = image[1];
        std::copy_n(camera.begin(), kCameraFloats, view_.camera.position);
        std::copy_n(environment.begin(), 3, view_.environment);
        std::copy_n(rotation.begin(), 9, view_.environment_rotation);
        view_.camera.kind = static_cast<CameraKind>(sizes[0]);
        view_.camera.full_width = sizes[1], view_.camera.full_height = sizes[2];
        view_.camera.window_x = sizes[3], view_.camera.window_y = sizes[4];
        view_.camera.aperture_blades = sizes[5];
    }

    size_t count() const { return index_.size(); }
    const SceneView& view() const { return view_; }
    SceneProbe probe(int32_t kind, float* value) const {
        return {static_cast<SceneProbeKind>(kind),
                static_cast<int64_t>(count()),
                index_.data(),
                instance_.data(),
                a.data(),
                b.data(),
                value};
    }
    ProbeTables tables() const {
        return {{"vertices", vertices},
                {"normals", normals},
                {"instance_to_world", instance_to_world},
                {"light_params", light_params},
                {"environment_pixels", environment_pixels},
                {"attributes", textures_.attributes.data(), textures_.attributes.size()},
                {"environment", view_.environment, 3},
                {"environment_rotation", view_.environment_rotation, 9},
                {"camera", view_.camera.position, kCameraFloats},
                {"a", a},
                {"b", b}};
    }

    const std::vector<float> vertices, normals, instance_to_world, light_params, environment_pixels, a, b;

 private:
    std::vector<int32_t> faces_, corner_normal_, face_material_, light_flags_, index_, instance_;
    TextureTables textures_;
    SceneView view_{};
};

nb::dict scene_backward(int32_t kind, nb::handle scene, nb::handle probe, nb::handle adjoint,
                        nb::handle instruction_set) {
    const Scene s(scene, probe);
    const KernelTable& table = with_probes(kernels(text(instruction_set)));
    return probe_backward(s.tables(), adjoint, s.count(), kSceneOutputs, [&](const ProbeSweep& sweep) {
        table.scene_derivatives(s.view(), s.probe(kind, nullptr), sweep);
    });
}

nb::tuple scene_forward(int32_t kind, nb::handle scene, nb::handle probe, nb::handle tangents,
                        nb::handle instruction_set) {
    const Scene s(scene, probe);
    const KernelTable& table = with_probes(kernels(text(instruction_set)));
    std::vector<float> value(s.count() * kSceneOutputs);
    const nb::object tangent =
        probe_forward(s.tables(), tangents, s.count(), kSceneOutputs, [&](const ProbeSweep& sweep) {
            table.scene_derivatives(s.view(), s.probe(kind, value.data()), sweep);
        });
    return nb::make_tuple(to_numpy(value, {s.count(), size_t{kSceneOutputs}}), tangent);
}

}  // namespace

void bind_scene_probes(nb::module_& m) {
    m.def("scene_probe_backward", &scene_backward, "kind"_a, "scene"_a, "probe"_a, "adjoint"_a,
          "instruction_set"_a, "Gradients of a part of the shading code that reads a scene.");
    m.def("scene_probe_forward", &scene_forward, "kind"_a, "scene"_a, "probe"_a, "tangents"_a,
          "instruction_set"_a, "Values and tangents of a part of the shading code that reads a scene.");
}

}  // namespace edgegrad
