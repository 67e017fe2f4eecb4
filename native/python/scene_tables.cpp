#include "python/scene_tables.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "python/numpy_arrays.h"
#include "python/textures.h"

namespace edgegrad {
namespace {

namespace nb = nanobind;

template <size_t N>
void fill(float (&out)[N], nb::handle object, const char* name) {
    const std::vector<float> values = column<float>(object, name);
    if (values.size() != N)
        throw std::invalid_argument(std::string("the table '") + name + "' has another length");
    std::copy(values.begin(), values.end(), out);
}

void check_indices(const std::vector<int32_t>& indices, size_t size, const char* what, int32_t least = 0) {
    for (int32_t i : indices)
        if (i < least || i >= static_cast<int64_t>(size))
            throw std::invalid_argument(std::string("the tables' ") + what + " are out of range");
}

void check_lights(const SceneTables::LightRows& lights) {
    const size_t rows = lights.kind.size();
    for (const auto* values :
         {&lights.flags, &lights.visible_to, &lights.receivers, &lights.blockers, &lights.max_bounces})
        if (values->size() != rows) throw std::invalid_argument("the light table's sizes disagree");
    if (lights.params.size() != kLightParams * rows)
        throw std::invalid_argument("the light table's sizes disagree");
    for (int32_t kind : lights.kind)
        if (kind < kPointSource || kind > kConeLight)
            throw std::invalid_argument("the light table has an unknown kind");
}

std::vector<FieldTable> read_fields(nb::handle t) {
    std::vector<FieldTable> fields;
    for (const nb::handle field : nb::cast<nb::tuple>(t.attr("fields"))) {
        FieldTable f{};
        const InputArray<float> values(field.attr("values"), "values", {-1, -1, -1});
        f.given = values.data();
        for (int a = 0; a < 3; ++a) {
            if (values.shape(a) < 4)
                throw std::invalid_argument("a field has fewer than 4 coefficients along an axis");
            f.size[a] = static_cast<int32_t>(values.shape(a));
        }
        const auto rows = column<double>(field, "to_world");
        if (rows.size() != 12) throw std::invalid_argument("a field's transform has the wrong shape");
        std::copy(rows.begin(), rows.end(), f.to_world);
        fields.push_back(std::move(f));
    }
    return fields;
}

void read_geometry(nb::handle t, GeometryTables& s) {
    s.vertices = column<float>(t, "vertices");
    s.faces = column<uint32_t, int32_t>(t, "faces");
    s.face_material = column<int32_t>(t, "face_material");
    s.mesh_first_vertex = column<int64_t, int32_t>(t, "mesh_first_vertex");
    s.mesh_first_face = column<int64_t, int32_t>(t, "mesh_first_face");
    for (uint8_t v : column<uint8_t>(t, "visible")) s.visible_meshes += v;
    s.mesh_mask = column<uint32_t, int32_t>(t, "mesh_mask");
    s.mesh_receivers = column<uint32_t, int32_t>(t, "mesh_receivers");
    s.mesh_terminator = column<float>(t, "mesh_terminator");
    s.mesh_dimming = column<float>(t, "mesh_dimming");
    s.corner_normal = column<int32_t>(t, "corner_normal");
    s.mesh_first_normal = column<int64_t, int32_t>(t, "mesh_first_normal");
    s.mesh_custom = column<uint8_t>(t, "mesh_custom");
    s.custom_normals = column<float>(t, "custom_normals");
    s.instance_mesh = column<int32_t>(t, "instance_mesh");
    s.instance_to_world = column<float>(t, "instance_to_world");
    s.fields = read_fields(t);
    if (s.fields.size() > static_cast<size_t>(s.visible_meshes))
        throw std::invalid_argument("the tables' sizes disagree");
    for (int32_t m = s.first_field(); m < s.visible_meshes; ++m)
        if (s.mesh_first_face[static_cast<size_t>(m) + 1] != s.mesh_first_face[static_cast<size_t>(m)] + 1)
            throw std::invalid_argument("a field must have one face");
    check_indices(s.faces, s.vertices.size() / 3, "faces");
    check_indices(s.instance_mesh, static_cast<size_t>(s.visible_meshes), "instances");
    check_indices(s.corner_normal, static_cast<size_t>(s.mesh_first_normal.back()), "shading normals", -1);
    if (s.instance_to_world.size() != 12 * s.instance_mesh.size())
        throw std::invalid_argument("the tables' sizes disagree");
}

std::shared_ptr<const EnvironmentMap> read_environment_map(nb::handle t) {
    const nb::object pixels = t.attr("environment_pixels");
    if (pixels.is_none()) return nullptr;
    const InputArray<float> array(pixels, "environment_pixels", {-1, -1, 3});
    if (array.size() == 0) throw std::invalid_argument("the environment's image is empty");
    return std::make_shared<EnvironmentMap>(array.data(), static_cast<int32_t>(array.shape(1)),
                                            static_cast<int32_t>(array.shape(0)));
}

}  // namespace

CameraView read_camera(nb::handle t) {
    CameraView c{};
    const auto row = column<float>(t, "camera");
    if (row.size() != kCameraFloats) throw std::invalid_argument("the camera's row has another length");
    static_assert(offsetof(CameraView, position) == 0);
    std::memcpy(static_cast<void*>(&c), row.data(), sizeof(float) * kCameraFloats);
    c.kind = static_cast<CameraKind>(nb::cast<int32_t>(t.attr("camera_kind")));
    const auto full = column<int32_t>(t, "full_size"), window = column<int32_t>(t, "window");
    c.full_width = full.at(0), c.full_height = full.at(1);
    c.window_x = window.at(0), c.window_y = window.at(1);
    c.aperture_blades = nb::cast<int32_t>(t.attr("aperture_blades"));
    c.width = nb::cast<int32_t>(t.attr("width"));
    c.height = nb::cast<int32_t>(t.attr("height"));
    c.clip_start = nb::cast<float>(t.attr("clip_start"));
    c.clip_end = nb::cast<float>(t.attr("clip_end"));
    return c;
}

void read_values(nb::handle t, ValueTables& s) {
    const nb::object materials = t.attr("materials");
    s.material_first_closure = column<int32_t>(materials, "first_closure");
    s.closure_kind = column<int32_t>(materials, "kind");
    s.closure_flags = column<int32_t>(materials, "flags");
    s.closure_params = column<float>(materials, "params");
    const nb::object lights = t.attr("lights");
    s.lights.params = column<float>(lights, "params");
    s.lights.kind = column<int32_t>(lights, "kind");
    s.lights.flags = column<int32_t>(lights, "flags");
    s.lights.visible_to = column<int32_t>(lights, "visible_to");
    s.lights.receivers = column<int32_t>(lights, "receivers");
    s.lights.blockers = column<int32_t>(lights, "blockers");
    s.lights.max_bounces = column<int32_t>(lights, "max_bounces");
    s.media = column<float>(t, "media");
    fill(s.world_medium, t, "world_medium");
    fill(s.environment_rotation, t, "environment_rotation");
    s.environment_mask = nb::cast<int32_t>(t.attr("environment_mask"));
    s.filter_kind = nb::cast<int32_t>(t.attr("filter_kind"));
    s.filter_width = nb::cast<float>(t.attr("filter_width"));
    s.emission = column<float>(t, "emission");
    s.emission_two_sided = column<uint8_t, int32_t>(t, "emission_two_sided");
    fill(s.environment, t, "environment");
    s.camera = read_camera(t);
    if (s.closure_params.size() != kMaterialParams * s.closure_kind.size())
        throw std::invalid_argument("the tables' sizes disagree");
    if (s.media.size() + kMediumFloats != kMediumFloats * s.material_first_closure.size())
        throw std::invalid_argument("the table of media has another length");
    check_lights(s.lights);
}

SceneTables read_tables(nb::handle t) {
    SceneTables s;
    read_geometry(t, s);
    read_values(t, s);
    const nb::object textures = t.attr("textures");
    if (!textures.is_none()) s.textures = read_textures(textures);
    s.environment_map = read_environment_map(t);
    check_indices(s.face_material, s.emission.size() / 3, "face materials");
    return s;
}

}  // namespace edgegrad
