// The Python module `edgegrad._native`: checks arrays, releases the interpreter's lock, forwards.
// What the functions compute is described in core/rendering/renderer.py and at the kernels.
#include <nanobind/nanobind.h>

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <memory>
#include <stdexcept>

#include "boundary/curves/learned_weights.h"
#include "embree/library.h"
#include "engine/decisions/decisions.h"
#include "engine/decisions/picture_facts.h"
#include "engine/engine.h"
#include "kernels/dispatch.h"
#include "python/bindings.h"
#include "python/call.h"
#include "python/numpy_arrays.h"
#include "python/probes/light_sampling.h"
#include "python/probes/ray_queries.h"
#include "python/scene_tables.h"
#include "python/textures.h"
#include "tasks/kernel_table.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using edgegrad::column;
using edgegrad::Engine;
using edgegrad::InputArray;
using edgegrad::OutputArray;
using edgegrad::Progress;
using edgegrad::RenderOptions;
using edgegrad::SceneTables;
using edgegrad::text;
using edgegrad::to_list;
using edgegrad::without_interpreter;
using edgegrad::WithoutInterpreter;

const char* reason_name(edgegrad::Reason reason) {
    return edgegrad::kReasonNames[static_cast<size_t>(reason)];
}

// The effects that occur, and the place of each parameter's effect among them.
nb::tuple effects(const std::vector<edgegrad::ParameterEffect>& by_parameter) {
    constexpr size_t reasons = static_cast<size_t>(edgegrad::Reason::kReasons);
    std::array<int, 2 * reasons> place;
    place.fill(-1);
    nb::list kinds;
    std::string places;
    for (const edgegrad::ParameterEffect& p : by_parameter) {
        int& at = place[2 * static_cast<size_t>(p.shading) + p.picture_stays];
        if (at < 0) {
            at = static_cast<int>(nb::len(kinds));
            kinds.append(nb::make_tuple(reason_name(p.shading), p.picture_stays));
        }
        places.push_back(static_cast<char>(at));
    }
    return nb::make_tuple(nb::tuple(kinds), nb::bytes(places.data(), places.size()));
}

// The decision on each part of a derivative, as tuples (core/derivatives/decisions.py).
nb::list decision_list(const edgegrad::Decisions& decided) {
    constexpr const char* kOutcomes[] = {"computed", "zero", "missing"};
    const auto indices = [](const std::vector<int32_t>& values) { return nb::tuple(to_list(values)); };
    const auto index_pairs = [](const std::vector<std::array<int32_t, 2>>& values) {
        nb::list out;
        for (const auto& v : values) out.append(nb::make_tuple(v[0], v[1]));
        return nb::tuple(out);
    };
    nb::list out;
    for (size_t k = 0; k < edgegrad::kPartCount; ++k) {
        const auto& d = decided.at(static_cast<edgegrad::Part>(k));
        if (!d) continue;
        const edgegrad::EdgeCounts& e = d->edges;
        out.append(nb::make_tuple(
            edgegrad::kPartTable[k].name, edgegrad::kTermNames[edgegrad::kPartTable[k].term],
            kOutcomes[static_cast<size_t>(d->outcome)], reason_name(d->reason),
            nb::make_tuple(e.of, e.kept, e.flat, e.seams, e.still), indices(d->meshes), indices(d->lights),
            indices(d->materials), index_pairs(d->pairs), index_pairs(d->pierced), d->limit, d->samples,
            d->seconds, effects(d->by_parameter)));
    }
    return out;
}

// core/rendering/options.py
RenderOptions read_options(nb::handle given) {
    RenderOptions o;
    const nb::object terms = given.attr("terms"), bounces = given.attr("bounces");
    for (int32_t k = 0; k < edgegrad::kDerivativeTerms; ++k)
        o.terms[k] = nb::cast<bool>(terms.attr("__contains__")(edgegrad::kTermNames[k]));
    o.samples = nb::cast<int32_t>(given.attr("spp"));
    o.seed = nb::cast<uint32_t>(given.attr("seed"));
    o.max_depth = nb::cast<int32_t>(given.attr("max_depth"));
    o.limits = {
        nb::cast<int32_t>(bounces.attr("diffuse")),      nb::cast<int32_t>(bounces.attr("glossy")),
        nb::cast<int32_t>(bounces.attr("transmission")), nb::cast<int32_t>(bounces.attr("transparent")),
        nb::cast<int32_t>(bounces.attr("medium")),       nb::cast<int32_t>(bounces.attr("ambient"))};
    o.filter_glossy = nb::cast<float>(bounces.attr("filter_glossy"));
    o.caustics_alone = nb::cast<bool>(given.attr("caustics_alone"));
    const std::string edges = text(given.attr("field_edges"));
    for (int32_t k = 0; edges != edgegrad::kFieldEdges[static_cast<int32_t>(o.field_edges)]; ++k)
        o.field_edges = static_cast<edgegrad::FieldEdges>(k);
    o.two_passes = nb::cast<bool>(given.attr("two_passes"));
    o.most_placed_edges = nb::cast<int64_t>(given.attr("most_placed_edges"));
    o.camera_sampled_alpha = nb::cast<float>(given.attr("camera_sampled_alpha"));
    if (o.samples < 1) throw std::invalid_argument("spp must be at least 1");
    const nb::object force = given.attr("force");
    for (size_t k = 0; k < edgegrad::kPartCount; ++k)
        if (nb::cast<bool>(force.attr("__contains__")(edgegrad::kPartTable[k].name))) o.force.set(k);
    return o;
}

// For a picture.
OutputArray<float> picture_array(const edgegrad::CameraView& c) {
    return OutputArray<float>({static_cast<size_t>(c.height), static_cast<size_t>(c.width), 3});
}

// What a derivative has left out (core/rendering/non_finite.py).
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
    Scene(nb::handle tables, int threads, nb::handle instruction_set, nb::handle embree)
        : kernels_(edgegrad::kernels(text(instruction_set))) {
        SceneTables s = edgegrad::read_tables(tables);
        const edgegrad::embree::Api& api = edgegrad::embree::load(text(embree));
        const WithoutInterpreter without;
        engine_ = std::make_unique<Engine>(api, kernels_, std::move(s), threads);
    }

    void build_bvh() {
        const WithoutInterpreter without;
        engine_->build_bvh();
    }
    bool has_bvh() const { return engine_->has_bvh(); }

    void set_edges(nb::handle edges) {
        std::vector<uint32_t> vertices = column<uint32_t>(edges, "vertices");
        std::vector<uint32_t> face_first = column<uint32_t>(edges, "face_first");
        std::vector<uint32_t> faces = column<uint32_t>(edges, "faces");
        std::vector<uint32_t> opposite = column<uint32_t>(edges, "opposite");
        const std::vector<uint32_t> collinear = column<uint32_t>(edges, "collinear");
        std::vector<uint8_t> sharing = column<uint8_t>(edges, "sharing");
        const std::vector<uint32_t> touching = column<uint32_t>(edges, "touching");
        const WithoutInterpreter without;
        engine_->set_edges(std::move(vertices), std::move(face_first), std::move(faces), std::move(opposite),
                           collinear, std::move(sharing), touching);
    }

    void update(nb::handle tables) {
        SceneTables s = edgegrad::read_tables(tables);
        const WithoutInterpreter without;
        engine_->update(std::move(s));
    }

    void update_values(nb::handle tables) {
        edgegrad::ValueTables values;
        edgegrad::read_values(tables, values);
        engine_->update_values(std::move(values));
    }

    void move_vertices(int32_t mesh, nb::handle vertices, nb::handle origin) {
        const InputArray<double> rows(vertices, "vertices", {-1, 3}), from(origin, "origin", {3});
        const WithoutInterpreter without;
        engine_->move_vertices(mesh, rows.data(), rows.shape(0), from.data());
    }

    void set_camera(nb::handle tables) { engine_->set_camera(edgegrad::read_camera(tables)); }

    nb::tuple render(nb::handle given, nb::object progress) {
        const OutputArray<float> pixels = picture_array(engine_->tables().camera);
        const RenderOptions options = read_options(given);
        const Progress report = edgegrad::make_progress(std::move(progress));
        const edgegrad::DroppedSamples dropped =
            without_interpreter([&] { return engine_->render(options, report, pixels.data()); });
        return nb::make_tuple(pixels.array(), dropped.count, dropped.first);
    }

    nb::tuple add_samples(nb::handle given, int32_t first, nb::handle sums, nb::object progress) {
        const OutputArray<float> pixels = picture_array(engine_->tables().camera);
        const edgegrad::ArrayMemory sum(sums, "sums", edgegrad::ElementType::of<double>(), true);
        if (sum.bytes() != pixels.size() * sizeof(double))
            throw std::invalid_argument("the array 'sums' must have the size of the picture");
        const RenderOptions options = read_options(given);
        const Progress report = edgegrad::make_progress(std::move(progress));
        const edgegrad::DroppedSamples dropped = without_interpreter([&] {
            return engine_->add_samples(options, first, report, static_cast<double*>(sum.data()),
                                        pixels.data());
        });
        return nb::make_tuple(pixels.array(), dropped.count, dropped.first);
    }

    nb::tuple forward(nb::dict tangent, nb::dict requested, nb::handle given,
                      edgegrad::LearnedSampling* learned, nb::object progress) {
        const OutputArray<float> pixels = picture_array(engine_->tables().camera);
        const RenderOptions options = read_options(given);
        edgegrad::TableValues tangents;
        for (const auto& [name, values] : tangent) {
            const std::string table = text(name);
            const InputArray<double> floats(values, table.c_str());
            tangents[edgegrad::float_table(table)].assign(floats.data(), floats.data() + floats.size());
        }
        const edgegrad::Requested what(engine_->tables(), read_spans(requested));
        const Progress report = edgegrad::make_progress(std::move(progress));
        edgegrad::Dropped dropped;
        edgegrad::Decisions decided;
        without_interpreter([&] {
            engine_->forward(options, what, std::move(tangents), learned, report, pixels.data(), dropped,
                             decided);
        });
        return nb::make_tuple(pixels.array(), dropped_list(dropped), decision_list(decided));
    }

    nb::tuple backward(nb::handle adjoint, nb::dict requested, nb::handle given,
                       edgegrad::LearnedSampling* learned, nb::object progress) {
        const edgegrad::CameraView& c = engine_->tables().camera;
        const InputArray<float> image(adjoint, "adjoint", {c.height, c.width, 3});
        const RenderOptions options = read_options(given);
        const edgegrad::Requested what(engine_->tables(), read_spans(requested));
        const Progress report = edgegrad::make_progress(std::move(progress));
        edgegrad::Dropped dropped;
        edgegrad::Decisions decided;
        edgegrad::TableValues gradients = without_interpreter([&] {
            return engine_->backward(options, what, image.data(), learned, report, dropped, decided);
        });
        nb::dict out;
        for (auto& [table, values] : gradients)
            out[edgegrad::kFloatTableNames[static_cast<size_t>(table)]] =
                edgegrad::zeros_to_numpy(std::move(values));
        return nb::make_tuple(out, dropped_list(dropped), decision_list(decided));
    }

    // Decides what such a call computes, and what each of some parameters changes.
    // `parameters` (core/derivatives/table_derivatives.py, ParameterRows).
    nb::list decide(nb::dict requested, nb::handle given, nb::handle parameters) {
        const RenderOptions options = read_options(given);
        const edgegrad::Requested what(engine_->tables(), read_spans(requested));
        const edgegrad::ParameterFloats each = read_parameters(parameters);
        return decision_list(without_interpreter([&] { return engine_->decide(options, what, each); }));
    }

    // core/planning/picture.py
    nb::dict picture_facts() {
        const edgegrad::PictureFacts f = without_interpreter([&] { return engine_->picture_facts(); });
        nb::dict out;
        out["triangles"] = f.triangles, out["instances"] = f.instances;
        out["transparent"] = f.transparent, out["lambertian"] = f.lambertian;
        out["glossy"] = f.glossy, out["refracting"] = f.refracting, out["flat"] = f.flat;
        out["emissive_triangles"] = f.emissive_triangles;
        out["material_rows"] = nb::tuple(to_list(f.material_rows));
        out["sampled_rows"] = nb::tuple(to_list(f.sampled_rows));
        out["environment"] = f.environment, out["environment_image"] = f.environment_image;
        out["media"] = f.media;
        return out;
    }

    const Engine& engine() const { return *engine_; }
    const char* instruction_set() const { return kernels_.name; }

 private:
    // Reads the requested spans of floats by table.
    static std::vector<edgegrad::FloatSpan> read_spans(const nb::dict& requested) {
        std::vector<edgegrad::FloatSpan> spans;
        for (const auto& [name, rows] : requested) {
            const std::string table = text(name);
            const InputArray<int64_t> ends(rows, table.c_str(), {-1, 2});
            for (size_t k = 0; k < ends.size(); k += 2)
                spans.push_back({edgegrad::float_table(table), static_cast<size_t>(ends.data()[k]),
                                 static_cast<size_t>(ends.data()[k + 1])});
        }
        return spans;
    }
    // Reads the spans of floats of each of some parameters.
    static edgegrad::ParameterFloats read_parameters(nb::handle given) {
        std::vector<edgegrad::FloatTable> tables;
        for (const nb::handle name : given.attr("tables"))
            tables.push_back(edgegrad::float_table(text(name)));
        const std::vector<int64_t> table = column<int64_t>(given, "table");
        const InputArray<int64_t> ends(given.attr("spans"), "spans", {static_cast<int64_t>(table.size()), 2});
        edgegrad::ParameterFloats out;
        for (size_t k = 0; k < table.size(); ++k)
            out.spans.push_back({tables.at(static_cast<size_t>(table[k])),
                                 static_cast<size_t>(ends.data()[2 * k]),
                                 static_cast<size_t>(ends.data()[2 * k + 1])});
        for (const int64_t last : column<int64_t>(given, "last")) {
            const size_t end = static_cast<size_t>(last);
            if (end > table.size() || (!out.last.empty() && end < out.last.back()))
                throw std::invalid_argument("the spans of parameters must follow each other");
            out.last.push_back(end);
        }
        return out;
    }

    const edgegrad::KernelTable& kernels_;
    std::unique_ptr<Engine> engine_;
};

// A method of Scene that calls a function of its engine.
template <typename Result, typename... Arguments>
auto of_engine(Result (*function)(const Engine&, Arguments...)) {
    return [function](const Scene& s, Arguments... arguments) { return function(s.engine(), arguments...); };
}

}  // namespace

NB_MODULE(_native, m) {
    m.doc() = "Edgegrad's native engine.";
    edgegrad::bind_bsdfs(m);
    edgegrad::bind_rays(m);
    edgegrad::bind_scene_probes(m);
    edgegrad::bind_textures(m);
    edgegrad::bind_process(m);
    edgegrad::bind_held_objects(m);
    edgegrad::bind_zeros(m);
    edgegrad::bind_learned_sampling(m);
    edgegrad::bind_mesh_arrays(m);
    edgegrad::bind_fields(m);
    m.def(
        "instruction_sets",
        [] {
            nb::list names;
            for (const std::string& name : edgegrad::instruction_sets()) names.append(name.c_str());
            return names;
        },
        "Instruction sets that this build has and this processor can run, the fastest first.");
    m.def(
        "embree_version",
        [](nb::handle path) {
            edgegrad::embree::load(text(path));
            return nb::str(edgegrad::embree::version().c_str());
        },
        "path"_a, "Version of the Embree library at `path`, loading it if need be.");
    nb::class_<Scene>(m, "Scene",
                      "A scene's tables with their BVH; see edgegrad.rendering.renderer.Renderer.")
        .def(nb::init<nb::handle, int, nb::handle, nb::handle>(), "tables"_a, "threads"_a,
             "instruction_set"_a, "embree"_a)
        .def("build_bvh", &Scene::build_bvh)
        .def_prop_ro("has_bvh", &Scene::has_bvh)
        .def("set_edges", &Scene::set_edges, "edges"_a)
        .def("update", &Scene::update, "tables"_a)
        .def("update_values", &Scene::update_values, "tables"_a)
        .def("move_vertices", &Scene::move_vertices, "mesh"_a, "vertices"_a, "origin"_a)
        .def("set_camera", &Scene::set_camera, "tables"_a)
        .def("render", &Scene::render, "options"_a, "progress"_a.none())
        .def("add_samples", &Scene::add_samples, "options"_a, "first"_a, "sums"_a, "progress"_a.none())
        .def("forward", &Scene::forward, "tangent"_a, "requested"_a, "options"_a, "learned"_a.none(),
             "progress"_a.none())
        .def("backward", &Scene::backward, "adjoint"_a, "requested"_a, "options"_a, "learned"_a.none(),
             "progress"_a.none())
        .def("sample_environment_light", of_engine(edgegrad::sample_environment_light))
        .def("look_at_environment", of_engine(edgegrad::look_at_environment))
        .def("sample_lights", of_engine(edgegrad::sample_lights))
        .def("meet_lights", of_engine(edgegrad::meet_lights))
        .def("picture_facts", &Scene::picture_facts)
        .def("decide", &Scene::decide, "requested"_a, "options"_a, "parameters"_a)
        .def("trace", of_engine(edgegrad::trace_rays), "origins"_a, "directions"_a, "far"_a, "shadow"_a)
        .def_prop_ro("instruction_set", &Scene::instruction_set);
}
