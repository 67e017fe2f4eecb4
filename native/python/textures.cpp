#include "python/textures.h"

#include <algorithm>

#include "kernels/dispatch.h"
#include "python/call.h"
#include "python/numpy_arrays.h"
#include "python/probes/probe_arrays.h"
#include "scene/textures/opcodes.h"
#include "tasks/kernel_table.h"
#include "tasks/probe_tasks.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace edgegrad {

namespace {

const char* const kOperations[] = {
#define EDGEGRAD_TEXTURE_OP(name) #name,
    EDGEGRAD_TEXTURE_OPS(EDGEGRAD_TEXTURE_OP)
#undef EDGEGRAD_TEXTURE_OP
};
constexpr int32_t kOperationCount = static_cast<int32_t>(std::size(kOperations));

void require(bool condition) {
    if (!condition) throw std::invalid_argument("the textures' tables contradict each other");
}

std::vector<TextureInstruction> read_code(nb::handle t, size_t constants) {
    const std::vector<int32_t> words = column<int32_t>(t, "code");
    constexpr size_t kWords = sizeof(TextureInstruction) / sizeof(int32_t);
    require(words.size() % kWords == 0);
    std::vector<TextureInstruction> code(words.size() / kWords);
    std::copy(words.begin(), words.end(), reinterpret_cast<int32_t*>(code.data()));
    for (const TextureInstruction& step : code) {
        require(step.op >= 0 && step.op < kOperationCount);
        for (int32_t r : step.out) require(r >= 0 && r <= kTextureScratch);
        for (int32_t r : step.in)
            require(r < kTextureRegisters && (r >= 0 || static_cast<size_t>(~r) < constants));
    }
    return code;
}

// Kernels index the floats of an image, and those of all attributes, by 32 bits.
void require_narrow(size_t floats, const char* what) {
    if (floats > size_t{0x7fffffff})
        throw std::invalid_argument(std::string(what) +
                                    " more than 2^31 numbers, which kernels can't address");
}

std::vector<TextureImage> read_images(nb::handle t, size_t pixels) {
    const auto offset = column<int64_t>(t, "image_offset");
    const auto shape = column<int32_t>(t, "image_shape"), mode = column<int32_t>(t, "image_mode");
    require(shape.size() == 3 * offset.size() && mode.size() == shape.size());
    std::vector<TextureImage> images(offset.size());
    for (size_t k = 0; k < images.size(); ++k) {
        TextureImage& image = images[k];
        image = {offset[k],   shape[3 * k],    shape[3 * k + 1], shape[3 * k + 2],
                 mode[3 * k], mode[3 * k + 1], mode[3 * k + 2]};
        const int64_t size = int64_t{image.width} * image.height * image.channels;
        require(size > 0 && image.offset >= 0 && static_cast<size_t>(image.offset + size) + 4 <= pixels);
        require_narrow(static_cast<size_t>(size), "an image has");
    }
    return images;
}

std::vector<TextureLookup> read_lookups(nb::handle t, size_t values) {
    const auto shape = column<int32_t>(t, "table_shape");
    require(shape.size() % 5 == 0);
    std::vector<TextureLookup> tables(shape.size() / 5);
    for (size_t k = 0; k < tables.size(); ++k) {
        const int32_t* s = shape.data() + 5 * k;
        tables[k] = {s[0], s[1], s[2], s[3], s[4]};
        require(s[0] >= 0 && s[1] >= 2 && static_cast<size_t>(s[0] + s[1] * s[2]) + 4 <= values);
    }
    return tables;
}

// An array's own memory. The tables that have it may be destroyed without the interpreter's lock.
SharedFloats shared_floats(nb::handle object, const char* name) {
    using Array = InputArray<float>;
    const std::shared_ptr<const Array> array(new Array(object.attr(name), name), [](const Array* owned) {
        const nb::gil_scoped_acquire interpreter;
        delete owned;
    });
    return {array, array->data(), array->size()};
}

std::vector<TextureAttribute> read_attributes(nb::handle t) {
    const auto offset = column<int64_t>(t, "attribute_offset");
    const auto components = column<int32_t>(t, "attribute_components");
    require(offset.size() == components.size());
    std::vector<TextureAttribute> attributes(offset.size());
    for (size_t k = 0; k < attributes.size(); ++k) attributes[k] = {offset[k], components[k]};
    return attributes;
}

std::vector<TextureGrid> read_grids(nb::handle t, size_t values) {
    const auto offset = column<int64_t>(t, "grid_offset");
    const auto shape = column<int32_t>(t, "grid_shape");
    require(shape.size() == 4 * offset.size());
    std::vector<TextureGrid> grids(offset.size());
    for (size_t k = 0; k < grids.size(); ++k) {
        const int32_t* s = shape.data() + 4 * k;
        grids[k] = {offset[k], {s[0], s[1], s[2]}, s[3]};
        const int64_t size = int64_t{s[0]} * s[1] * s[2] * s[3];
        require(s[3] >= 0 && s[3] <= 4 && (s[3] == 0 || (s[0] > 0 && s[1] > 0 && s[2] > 0)));
        require(offset[k] >= 0 && static_cast<size_t>(offset[k] + size) + 4 <= values);
    }
    return grids;
}

// Programs, and the points at which to run them (fields of `points` as in TextureTask).
class Points {
 public:
    Points(nb::handle tables, nb::handle points)
        : textures(read_textures(tables)),
          program_(column<int32_t>(points, "program")),
          face_(column<int32_t>(points, "face")),
          ray_kind_(column<int32_t>(points, "ray_kind")),
          backside_(column<int32_t>(points, "backside")),
          b1(column<float>(points, "b1")),
          b2(column<float>(points, "b2")),
          position(column<float>(points, "position")),
          normal(column<float>(points, "normal")),
          true_normal(column<float>(points, "true_normal")),
          view(column<float>(points, "view")) {
        const size_t n = count();
        require(face_.size() == n && ray_kind_.size() == n && backside_.size() == n && b1.size() == n &&
                b2.size() == n && position.size() == 3 * n && normal.size() == 3 * n &&
                true_normal.size() == 3 * n && view.size() == 3 * n);
        for (int32_t p : program_) require(p < static_cast<int32_t>(textures.program_first.size()) - 1);
        for (const TextureInstruction& step : textures.code)
            if (step.op == static_cast<int32_t>(TextureOp::BARYCENTRICS) ||
                step.op == static_cast<int32_t>(TextureOp::NORMAL_MAP))
                throw std::invalid_argument("bumps of attributes and normal maps need the meshes of a scene");
    }

    size_t count() const { return program_.size(); }
    SceneView scene() const {
        SceneView view{};
        view.textures = textures.view();
        return view;
    }
    TextureTask task() const {
        return {static_cast<int64_t>(count()),
                program_.data(),
                face_.data(),
                ray_kind_.data(),
                backside_.data(),
                b1.data(),
                b2.data(),
                position.data(),
                normal.data(),
                true_normal.data(),
                view.data()};
    }

    const TextureTables textures;

 private:
    std::vector<int32_t> program_, face_, ray_kind_, backside_;

 public:
    const std::vector<float> b1, b2, position, normal, true_normal, view;
};

// Runs the programs and overwrites their columns in `rows`.
void evaluate(nb::handle tables, nb::handle points, nb::handle rows, nb::handle instruction_set) {
    const Points p(tables, points);
    const ArrayMemory out(rows, "rows", ElementType::of<float>(), true);
    require(out.bytes() == p.count() * kMaterialParams * sizeof(float));
    const KernelTable& table = kernels(text(instruction_set));
    const WithoutInterpreter without;
    table.textures(p.scene(), p.task(), static_cast<float*>(out.data()));
}

// Names of the floats on which programs depend.
ProbeTables tables_of(const Points& p) {
    const TextureTables& t = p.textures;
    return {{"b1", p.b1},
            {"b2", p.b2},
            {"position", p.position},
            {"normal", p.normal},
            {"true_normal", p.true_normal},
            {"view", p.view},
            {"pixels", t.pixels.data(), t.pixels.size()},
            {"constants", t.constants},
            {"lookups", t.lookups},
            {"attributes", t.attributes.data(), t.attributes.size()}};
}

nb::dict backward(nb::handle tables, nb::handle points, nb::handle adjoint, nb::handle instruction_set) {
    const Points p(tables, points);
    const std::vector<float> rows(p.count() * kMaterialParams);
    const KernelTable& table = with_probes(kernels(text(instruction_set)));
    return probe_backward(tables_of(p), adjoint, p.count(), kMaterialParams, [&](const ProbeSweep& sweep) {
        table.texture_derivatives(p.scene(), p.task(), rows.data(), sweep);
    });
}

nb::object forward(nb::handle tables, nb::handle points, nb::handle tangents, nb::handle instruction_set) {
    const Points p(tables, points);
    const std::vector<float> rows(p.count() * kMaterialParams);
    const KernelTable& table = with_probes(kernels(text(instruction_set)));
    return probe_forward(tables_of(p), tangents, p.count(), kMaterialParams, [&](const ProbeSweep& sweep) {
        table.texture_derivatives(p.scene(), p.task(), rows.data(), sweep);
    });
}

}  // namespace

TextureTables read_textures(nb::handle t) {
    TextureTables s;
    s.constants = column<float>(t, "constants");
    s.code = read_code(t, s.constants.size());
    s.program_first = column<int32_t>(t, "program_first");
    require(!s.program_first.empty() && s.program_first.front() == 0 &&
            static_cast<size_t>(s.program_first.back()) == s.code.size() &&
            std::is_sorted(s.program_first.begin(), s.program_first.end()));
    s.closure_program = column<int32_t>(t, "closure_program");
    s.closure_weight_program = column<int32_t>(t, "closure_weight_program");
    s.closure_normal_program = column<int32_t>(t, "closure_normal_program");
    s.closure_uv = column<int32_t>(t, "closure_uv");
    s.closure_tangent = column<int32_t>(t, "closure_tangent");
    s.pixels = shared_floats(t, "pixels");
    s.images = read_images(t, s.pixels.size());
    s.lookups = column<float>(t, "lookups");
    s.tables = read_lookups(t, s.lookups.size());
    s.mesh_attributes = read_attributes(t);
    s.attributes = shared_floats(t, "attributes");
    require_narrow(s.attributes.size(), "the attributes of meshes and fields have");
    s.field_grids = read_grids(t, s.attributes.size());
    s.face_mesh = column<int32_t>(t, "face_mesh");
    s.mesh_extent = column<int32_t>(t, "mesh_extent");
    return s;
}

void bind_textures(nb::module_& m) {
    m.def(
        "texture_operations", [] { return to_list(kOperations); },
        "Names of the operations of texture programs, in the order of their numbers.");
    m.def("evaluate_textures", &evaluate, "tables"_a, "points"_a, "rows"_a, "instruction_set"_a,
          "Runs texture programs at points and overwrites the columns of `rows` that they compute.");
    m.def("textures_backward", &backward, "tables"_a, "points"_a, "adjoint"_a, "instruction_set"_a,
          "Gradients of texture programs' rows.");
    m.def("textures_forward", &forward, "tables"_a, "points"_a, "tangents"_a, "instruction_set"_a,
          "Tangents of texture programs' rows.");
}

}  // namespace edgegrad
