#include "texture/bindings.h"

#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>

#include "column.h"
#include "dispatch.h"
#include "texture/opcodes.h"

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

std::vector<TextureAttribute> read_attributes(nb::handle t) {
    const auto offset = column<int64_t>(t, "attribute_offset");
    const auto components = column<int32_t>(t, "attribute_components");
    require(offset.size() == components.size());
    std::vector<TextureAttribute> attributes(offset.size());
    for (size_t k = 0; k < attributes.size(); ++k) attributes[k] = {offset[k], components[k]};
    return attributes;
}

using Rows = nb::ndarray<float, nb::shape<-1, kMaterialParams>, nb::c_contig, nb::device::cpu>;

// Runs programs at points (fields of `points` as in TextureTask) and overwrites their places in `rows`.
void evaluate(nb::handle tables, nb::handle points, Rows rows, const std::string& instruction_set) {
    const TextureTables textures = read_textures(tables);
    const auto program = column<int32_t>(points, "program"), face = column<int32_t>(points, "face"),
               ray_kind = column<int32_t>(points, "ray_kind"), backside = column<int32_t>(points, "backside");
    const auto b1 = column<float>(points, "b1"), b2 = column<float>(points, "b2"),
               position = column<float>(points, "position"), normal = column<float>(points, "normal"),
               true_normal = column<float>(points, "true_normal"), view = column<float>(points, "view");
    const size_t n = program.size();
    require(face.size() == n && ray_kind.size() == n && backside.size() == n && b1.size() == n &&
            b2.size() == n && position.size() == 3 * n && normal.size() == 3 * n &&
            true_normal.size() == 3 * n && view.size() == 3 * n && rows.shape(0) == n);
    for (int32_t p : program) require(p < static_cast<int32_t>(textures.program_first.size()) - 1);
    SceneView scene{};
    scene.textures = textures.view();
    const TextureTask task = {static_cast<int64_t>(n), program.data(),     face.data(), ray_kind.data(),
                              backside.data(),         b1.data(),          b2.data(),   position.data(),
                              normal.data(),           true_normal.data(), view.data()};
    const nb::gil_scoped_release release;
    kernels(instruction_set).textures(scene, task, rows.data());
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
    s.leaf_program = column<int32_t>(t, "leaf_program");
    s.leaf_weight_program = column<int32_t>(t, "leaf_weight_program");
    s.leaf_uv = column<int32_t>(t, "leaf_uv");
    s.leaf_tangent = column<int32_t>(t, "leaf_tangent");
    s.pixels = column<float>(t, "pixels");
    s.images = read_images(t, s.pixels.size());
    s.lookups = column<float>(t, "lookups");
    s.tables = read_lookups(t, s.lookups.size());
    s.mesh_attributes = read_attributes(t);
    s.attributes = column<float>(t, "attributes");
    s.face_mesh = column<int32_t>(t, "face_mesh");
    s.mesh_box = column<float>(t, "mesh_box");
    return s;
}

void bind_textures(nb::module_& m) {
    m.def(
        "texture_operations",
        [] { return std::vector<std::string>(kOperations, kOperations + kOperationCount); },
        "Names of the operations of texture programs, in the order of their numbers.");
    m.def("evaluate_textures", &evaluate, "tables"_a, "points"_a, "rows"_a, "instruction_set"_a,
          "Runs texture programs at points and overwrites their places in rows.");
}

}  // namespace edgegrad
