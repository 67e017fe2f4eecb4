// The textures' tables by value (core/tables/textures/texture_tables.py).
#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "scene/table_rows.h"
#include "scene/textures/opcodes.h"
#include "scene/textures/texture_view.h"

namespace edgegrad {

// Floats in memory that something else owns, which lives as long as this. Large arrays are not copied, and
// the tables of a scene before and after an update share those that it leaves as they are.
class SharedFloats {
 public:
    SharedFloats() = default;
    SharedFloats(std::shared_ptr<const void> owner, const float* data, size_t size)
        : owner_(std::move(owner)), data_(data), size_(size) {}
    const float* data() const { return data_; }
    size_t size() const { return size_; }

 private:
    std::shared_ptr<const void> owner_;
    const float* data_ = nullptr;
    size_t size_ = 0;
};
inline const float* rows_of(const SharedFloats& table) {
    return table.size() ? table.data() : zero_row<float>();
}

struct TextureTables {
    std::vector<TextureInstruction> code;
    std::vector<int32_t> program_first;
    std::vector<float> constants;
    std::vector<int32_t> closure_program, closure_weight_program, closure_normal_program, closure_uv,
        closure_tangent;
    std::vector<TextureImage> images;
    SharedFloats pixels;
    // The least and the largest value of each image and each attribute that is known
    // (scene/textures/value_bounds.h), or empty.
    std::vector<std::optional<std::array<float, 2>>> image_range, attribute_range;
    // Steps that make colors of hues that may leave [0, 1], where the colors jump, as places in `code`,
    // ascending (scene/textures/value_bounds.h).
    std::vector<int32_t> leaving_hues;
    std::vector<TextureLookup> tables;
    std::vector<float> lookups;
    std::vector<TextureAttribute> mesh_attributes;
    std::vector<TextureGrid> field_grids;
    SharedFloats attributes;
    std::vector<int32_t> face_mesh;
    std::vector<int32_t> mesh_extent;

    TextureView view() const {
        TextureView v{};
        v.code = rows_of(code);
        v.program_first = rows_of(program_first);
        v.constants = rows_of(constants);
        const bool any = program_first.size() > 1;
        v.closure_program = any ? closure_program.data() : nullptr;
        v.closure_weight_program = any ? closure_weight_program.data() : nullptr;
        const bool displaced = std::any_of(closure_normal_program.begin(), closure_normal_program.end(),
                                           [](int32_t program) { return program >= 0; });
        v.closure_normal_program = displaced ? closure_normal_program.data() : nullptr;
        v.reads_history = std::any_of(code.begin(), code.end(), reads_ray_history<TextureInstruction>);
        v.images = rows_of(images);
        v.pixels = rows_of(pixels);
        v.tables = rows_of(tables);
        v.lookups = rows_of(lookups);
        v.mesh_attributes = rows_of(mesh_attributes);
        v.field_grids = rows_of(field_grids);
        v.attributes = rows_of(attributes);
        v.face_mesh = rows_of(face_mesh);
        v.mesh_count = static_cast<int32_t>(mesh_extent.size() / kMeshExtent);
        v.closure_uv = closure_uv.data();
        v.closure_tangent = closure_tangent.data();
        v.mesh_extent = mesh_extent.data();
        return v;
    }
};

}  // namespace edgegrad
