// The Python module `edgegrad._native`: checks arrays, releases the interpreter's lock, forwards.
// What the functions compute is described in core/renderer.py and at the kernels.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <memory>
#include <stdexcept>

#include "adjoint/probe_bindings.h"
#include "boundary/learned_masses.h"
#include "column.h"
#include "dispatch.h"
#include "embree/library.h"
#include "emitter_bindings.h"
#include "engine.h"
#include "ray_bindings.h"
#include "shading/bsdf/bindings.h"
#include "texture/bindings.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using edgegrad::column;
using edgegrad::Engine;
using edgegrad::Progress;
using edgegrad::RenderOptions;
using edgegrad::SceneTables;

template <size_t N>
void fill(float (&out)[N], nb::handle object, const char* name, size_t first = 0) {
    const std::vector<float> values = column<float>(object, name);
    if (values.size() < first + N)
        throw std::invalid_argument(std::string("the table '") + name + "' is too short");
    std::copy_n(values.begin() + static_cast<ptrdiff_t>(first), N, out);
}

void check_indices(const std::vector<int32_t>& indices, size_t size, const char* what, int32_t least = 0) {
    for (int32_t i : indices)
        if (i < least || i >= static_cast<int64_t>(size))
            throw std::invalid_argument(std::string("the tables' ") + what + " are out of range");
}

void check_lights(const SceneTables::LightRows& lights) {
    const size_t rows = lights.kind.size();
    for (const auto* values : {&lights.flags, &lights.visible_to, &lights.receivers, &lights.blockers})
        if (values->size() != rows) throw std::invalid_argument("the light table's sizes disagree");
    if (lights.params.size() != edgegrad::kLightParams * rows)
        throw std::invalid_argument("the light table's sizes disagree");
    for (int32_t kind : lights.kind)
        if (kind < edgegrad::kPointSource || kind > edgegrad::kConeLight)
            throw std::invalid_argument("the light table has an unknown kind");
}

edgegrad::CameraView read_camera(nb::handle t) {
    edgegrad::CameraView c{};
    fill(c.position, t, "camera_position");
    fill(c.right, t, "camera_axes", 0);
    fill(c.up, t, "camera_axes", 3);
    fill(c.back, t, "camera_axes", 6);
    fill(c.principal, t, "principal_point");
    c.kind = static_cast<edgegrad::CameraKind>(nb::cast<int32_t>(t.attr("camera_kind")));
    c.focal = nb::cast<float>(t.attr("focal"));
    c.pixel_aspect = nb::cast<float>(t.attr("pixel_aspect"));
    fill(c.panorama, t, "panorama");
    const auto full = column<int32_t>(t, "full_size"), window = column<int32_t>(t, "window");
    c.full_width = full.at(0), c.full_height = full.at(1);
    c.window_x = window.at(0), c.window_y = window.at(1);
    const auto aperture = column<float>(t, "aperture");
    c.aperture_radius = aperture.at(0), c.focus_distance = aperture.at(1);
    c.aperture_blades = static_cast<int32_t>(aperture.at(2));
    c.aperture_rotation = aperture.at(3), c.aperture_ratio = aperture.at(4);
    c.width = nb::cast<int32_t>(t.attr("width"));
    c.height = nb::cast<int32_t>(t.attr("height"));
    c.clip_start = nb::cast<float>(t.attr("clip_start"));
    c.clip_end = nb::cast<float>(t.attr("clip_end"));
    return c;
}

void read_geometry(nb::handle t, edgegrad::GeometryTables& s) {
    s.vertices = column<float>(t, "vertices");
    s.faces = column<uint32_t, int32_t>(t, "faces");
    s.face_material = column<int32_t>(t, "face_material");
    s.mesh_first_vertex = column<int64_t, int32_t>(t, "mesh_first_vertex");
    s.mesh_first_face = column<int64_t, int32_t>(t, "mesh_first_face");
    for (uint8_t v : column<uint8_t>(t, "visible")) s.visible_meshes += v;
    s.mesh_mask = column<uint32_t, int32_t>(t, "mesh_mask");
    s.mesh_receivers = column<uint32_t, int32_t>(t, "mesh_receivers");
    s.mesh_terminator = column<float>(t, "mesh_terminator");
    s.corner_normal = column<int32_t>(t, "corner_normal");
    s.mesh_first_normal = column<int64_t, int32_t>(t, "mesh_first_normal");
    s.mesh_custom = column<uint8_t>(t, "mesh_custom");
    s.custom_normals = column<float>(t, "custom_normals");
    s.instance_mesh = column<int32_t>(t, "instance_mesh");
    s.instance_to_world = column<float>(t, "instance_to_world");
    check_indices(s.faces, s.vertices.size() / 3, "faces");
    check_indices(s.instance_mesh, static_cast<size_t>(s.visible_meshes), "instances");
    check_indices(s.corner_normal, static_cast<size_t>(s.mesh_first_normal.back()), "shading normals", -1);
    if (s.instance_to_world.size() != 12 * s.instance_mesh.size())
        throw std::invalid_argument("the tables' sizes disagree");
}

void read_values(nb::handle t, edgegrad::ValueTables& s) {
    const nb::object materials = t.attr("materials");
    s.material_first_leaf = column<int32_t>(materials, "first_leaf");
    s.leaf_kind = column<int32_t>(materials, "kind");
    s.leaf_flags = column<int32_t>(materials, "flags");
    s.leaf_params = column<float>(materials, "params");
    const nb::object lights = t.attr("lights");
    s.lights.params = column<float>(lights, "params");
    s.lights.kind = column<int32_t>(lights, "kind");
    s.lights.flags = column<int32_t>(lights, "flags");
    s.lights.visible_to = column<int32_t>(lights, "visible_to");
    s.lights.receivers = column<int32_t>(lights, "receivers");
    s.lights.blockers = column<int32_t>(lights, "blockers");
    fill(s.environment_rotation, t, "environment_rotation");
    s.environment_mask = nb::cast<int32_t>(t.attr("environment_mask"));
    s.filter_kind = nb::cast<int32_t>(t.attr("filter_kind"));
    s.filter_width = nb::cast<float>(t.attr("filter_width"));
    s.emission = column<float>(t, "emission");
    s.emission_two_sided = column<uint8_t, int32_t>(t, "emission_two_sided");
    fill(s.environment, t, "environment");
    s.camera = read_camera(t);
    if (s.leaf_params.size() != edgegrad::kMaterialParams * s.leaf_kind.size())
        throw std::invalid_argument("the tables' sizes disagree");
    check_lights(s.lights);
}

std::shared_ptr<const edgegrad::EnvironmentMap> read_environment_map(nb::handle t) {
    const nb::object pixels = t.attr("environment_pixels");
    if (pixels.is_none()) return nullptr;
    using Pixels = nb::ndarray<const float, nb::shape<-1, -1, 3>, nb::c_contig, nb::device::cpu>;
    const Pixels array = nb::cast<Pixels>(pixels);
    if (array.size() == 0) throw std::invalid_argument("the environment's image is empty");
    return std::make_shared<edgegrad::EnvironmentMap>(array.data(), static_cast<int32_t>(array.shape(1)),
                                                      static_cast<int32_t>(array.shape(0)));
}

SceneTables read_tables(nb::handle t) {
    SceneTables s;
    read_geometry(t, s);
    read_values(t, s);
    const nb::object textures = t.attr("textures");
    if (!textures.is_none()) s.textures = edgegrad::read_textures(textures);
    s.environment_map = read_environment_map(t);
    check_indices(s.face_material, s.emission.size() / 3, "face materials");
    return s;
}

Progress make_progress(nb::object callback) {
    return [callback = std::move(callback)](double fraction) {
        const nb::gil_scoped_acquire lock;
        // Ctrl-C must work during a long call even without a callback.
        if (PyErr_CheckSignals() != 0) throw nb::python_error();
        if (!callback.is_none()) callback(fraction);
    };
}

RenderOptions make_options(int samples, uint32_t seed, int max_depth, nb::handle bounces,
                           const std::vector<std::string>& terms = {}) {
    RenderOptions o;
    const auto has = [&](const char* term) {
        return std::find(terms.begin(), terms.end(), term) != terms.end();
    };
    o.interior = has("interior");
    o.primary = has("primary");
    o.shadow = has("shadow");
    o.indirect = has("indirect");
    o.samples = samples;
    o.seed = seed;
    o.max_depth = max_depth;
    o.limits = {nb::cast<int32_t>(bounces.attr("diffuse")), nb::cast<int32_t>(bounces.attr("glossy")),
                nb::cast<int32_t>(bounces.attr("transmission")),
                nb::cast<int32_t>(bounces.attr("transparent"))};
    if (samples < 1) throw std::invalid_argument("spp must be at least 1");
    return o;
}

template <typename T, typename Allocator>
nb::ndarray<nb::numpy, T> to_numpy(std::vector<T, Allocator>&& values, std::vector<size_t> shape) {
    using Values = std::vector<T, Allocator>;
    auto* held = new Values(std::move(values));
    nb::capsule owner(held, [](void* p) noexcept { delete static_cast<Values*>(p); });
    return nb::ndarray<nb::numpy, T>(held->data(), shape.size(), shape.data(), owner);
}

using Image = nb::ndarray<nb::numpy, float>;
using Vertices = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using AdjointImage = nb::ndarray<const float, nb::shape<-1, -1, 3>, nb::c_contig, nb::device::cpu>;

Image make_image(std::vector<float>&& pixels, const edgegrad::CameraView& c) {
    return to_numpy(std::move(pixels), {static_cast<size_t>(c.height), static_cast<size_t>(c.width), 3});
}

// What a derivative has left out (core/non_finite.py).
nb::list dropped_list(const edgegrad::Dropped& dropped) {
    nb::list out;
    for (const edgegrad::DroppedTerm& d : dropped)
        out.append(nb::make_tuple(d.term, d.count, d.pixel, nb::make_tuple(d.vertices[0], d.vertices[1]),
                                  nb::make_tuple(d.faces[0], d.faces[1])));
    return out;
}

// The engine together with its copy of the tables.
class Scene {
 public:
    Scene(nb::handle tables, int threads, const std::string& instruction_set, const std::string& embree)
        : kernels_(edgegrad::kernels(instruction_set)) {
        SceneTables s = read_tables(tables);
        const edgegrad::embree::Api& api = edgegrad::embree::load(embree);
        const nb::gil_scoped_release release;
        engine_ = std::make_unique<Engine>(api, kernels_, std::move(s), threads);
    }

    void set_edges(nb::handle edges) {
        engine_->set_edges(column<uint32_t>(edges, "vertices"), column<uint32_t>(edges, "face_first"),
                           column<uint32_t>(edges, "faces"), column<uint32_t>(edges, "opposite"));
    }

    void update(nb::handle tables) {
        SceneTables s = read_tables(tables);
        const nb::gil_scoped_release release;
        engine_->update(std::move(s));
    }

    void update_values(nb::handle tables) {
        edgegrad::ValueTables values;
        read_values(tables, values);
        engine_->update_values(std::move(values));
    }

    void move_vertices(int32_t mesh, Vertices vertices, const std::vector<double>& origin) {
        if (origin.size() != 3) throw std::invalid_argument("origin must have three values");
        const nb::gil_scoped_release release;
        engine_->move_vertices(mesh, vertices.data(), vertices.shape(0), origin.data());
    }

    void set_guided(bool guided) { engine_->set_guided(guided); }
    bool guided() const { return engine_->guided(); }
    void set_aimed(float alpha) { engine_->set_aimed(alpha); }
    float aimed() const { return engine_->aimed(); }
    void set_camera(nb::handle tables) { engine_->set_camera(read_camera(tables)); }

    Image render(int samples, uint32_t seed, int max_depth, nb::handle bounces, bool caustics_alone,
                 nb::object progress) {
        const edgegrad::CameraView& c = engine_->tables().camera;
        std::vector<float> pixels(3 * static_cast<size_t>(c.width) * static_cast<size_t>(c.height));
        RenderOptions options = make_options(samples, seed, max_depth, bounces);
        options.caustics_alone = caustics_alone;
        const Progress report = make_progress(std::move(progress));
        {
            const nb::gil_scoped_release release;
            engine_->render(options, report, pixels.data());
        }
        return make_image(std::move(pixels), c);
    }

    nb::tuple forward(nb::dict tangent, nb::dict wanted, int samples, uint32_t seed, int max_depth,
                      nb::handle bounces, const std::vector<std::string>& terms,
                      edgegrad::LearnedSampling* learned, nb::object progress) {
        const edgegrad::CameraView& c = engine_->tables().camera;
        std::vector<float> pixels(3 * static_cast<size_t>(c.width) * static_cast<size_t>(c.height));
        const RenderOptions options = make_options(samples, seed, max_depth, bounces, terms);
        edgegrad::TableValues tangents;
        for (const auto& [name, values] : tangent) {
            using Values = nb::ndarray<const double, nb::c_contig, nb::device::cpu>;
            const Values array = nb::cast<Values>(values);
            tangents[nb::cast<std::string>(name)].assign(array.data(), array.data() + array.size());
        }
        const edgegrad::Wanted what = read_wanted(wanted);
        const Progress report = make_progress(std::move(progress));
        edgegrad::Dropped dropped;
        {
            const nb::gil_scoped_release release;
            engine_->forward(options, what, std::move(tangents), learned, report, pixels.data(), dropped);
        }
        return nb::make_tuple(make_image(std::move(pixels), c), dropped_list(dropped));
    }

    nb::tuple backward(AdjointImage adjoint, nb::dict wanted, int samples, uint32_t seed, int max_depth,
                       nb::handle bounces, const std::vector<std::string>& terms,
                       edgegrad::LearnedSampling* learned, nb::object progress) {
        const edgegrad::CameraView& c = engine_->tables().camera;
        if (adjoint.shape(0) != static_cast<size_t>(c.height) ||
            adjoint.shape(1) != static_cast<size_t>(c.width))
            throw std::invalid_argument("the adjoint image has another size than the camera's picture");
        const RenderOptions options = make_options(samples, seed, max_depth, bounces, terms);
        const edgegrad::Wanted what = read_wanted(wanted);
        const Progress report = make_progress(std::move(progress));
        edgegrad::TableValues gradients;
        edgegrad::Dropped dropped;
        {
            const nb::gil_scoped_release release;
            gradients = engine_->backward(options, what, adjoint.data(), learned, report, dropped);
        }
        nb::dict out;
        for (auto& [name, values] : gradients) {
            const size_t size = values.size();
            out[name.c_str()] = to_numpy(std::move(values), {size});
        }
        return nb::make_tuple(out, dropped_list(dropped));
    }

    const Engine& engine() const { return *engine_; }
    const char* instruction_set() const { return kernels_.name; }

 private:
    // By table, the spans of floats that are asked for.
    edgegrad::Wanted read_wanted(const nb::dict& wanted) const {
        std::vector<edgegrad::TableSpan> spans;
        for (const auto& [name, rows] : wanted)
            for (const auto& [first, last] : nb::cast<std::vector<std::pair<size_t, size_t>>>(rows))
                spans.push_back({nb::cast<std::string>(name), first, last});
        return {engine_->tables(), spans};
    }

    const edgegrad::KernelTable& kernels_;
    std::unique_ptr<Engine> engine_;
};

}  // namespace

NB_MODULE(_native, m) {
    m.doc() = "Edgegrad's native engine.";
    edgegrad::bind_bsdfs(m);
    edgegrad::bind_rays(m);
    edgegrad::bind_scene_probes(m);
    edgegrad::bind_textures(m);
    m.def("instruction_sets", &edgegrad::instruction_sets,
          "Instruction sets that this build has and this processor can run, the fastest first.");
    m.def(
        "embree_version",
        [](const std::string& path) {
            edgegrad::embree::load(path);
            return edgegrad::embree::version();
        },
        "path"_a, "Version of the Embree library at `path`, loading it if need be.");
    nb::class_<edgegrad::LearnedSampling>(
        m, "LearnedSampling", "What gradients of one view have learned; shares and samples are by term.")
        .def(nb::init<>())
        .def_prop_rw(
            "share", [](const edgegrad::LearnedSampling& l) { return std::to_array(l.share); },
            [](edgegrad::LearnedSampling& l, const std::array<double, edgegrad::kDerivativeTerms>& share) {
                std::copy(share.begin(), share.end(), l.share);
            })
        .def_prop_ro("taken", [](const edgegrad::LearnedSampling& l) { return std::to_array(l.taken); });
    nb::class_<Scene>(m, "Scene", "A scene's tables with their BVH; see edgegrad.renderer.Renderer.")
        .def(nb::init<nb::handle, int, const std::string&, const std::string&>(), "tables"_a, "threads"_a,
             "instruction_set"_a, "embree"_a)
        .def("set_edges", &Scene::set_edges, "edges"_a)
        .def("update", &Scene::update, "tables"_a)
        .def("update_values", &Scene::update_values, "tables"_a)
        .def("move_vertices", &Scene::move_vertices, "mesh"_a, "vertices"_a, "origin"_a)
        .def("set_camera", &Scene::set_camera, "tables"_a)
        .def_prop_rw("guided", &Scene::guided, &Scene::set_guided)
        .def_prop_rw("aimed", &Scene::aimed, &Scene::set_aimed)
        .def("render", &Scene::render, "spp"_a, "seed"_a, "max_depth"_a, "bounces"_a, "caustics_alone"_a,
             "progress"_a.none())
        .def("forward", &Scene::forward, "tangent"_a, "wanted"_a, "spp"_a, "seed"_a, "max_depth"_a,
             "bounces"_a, "terms"_a, "learned"_a.none(), "progress"_a.none())
        .def("backward", &Scene::backward, "adjoint"_a, "wanted"_a, "spp"_a, "seed"_a, "max_depth"_a,
             "bounces"_a, "terms"_a, "learned"_a.none(), "progress"_a.none())
        .def("sample_sky", [](const Scene& s, nb::handle u,
                              nb::handle v) { return edgegrad::sample_sky(s.engine(), u, v); })
        .def("look_at_sky", [](const Scene& s, nb::handle w) { return edgegrad::look_at_sky(s.engine(), w); })
        .def("sample_lights",
             [](const Scene& s, nb::handle position, nb::handle normal, nb::handle u, nb::handle v,
                bool both_sides) {
                 return edgegrad::sample_lights(s.engine(), position, normal, u, v, both_sides);
             })
        .def("meet_lights",
             [](const Scene& s, nb::handle position, nb::handle normal, nb::handle w, nb::handle face,
                nb::handle r, nb::handle bsdf_pdf, int kind, bool both_sides) {
                 return edgegrad::meet_lights(s.engine(), position, normal, w, face, r, bsdf_pdf, kind,
                                              both_sides);
             })
        .def_prop_ro("instruction_set", &Scene::instruction_set);
}
