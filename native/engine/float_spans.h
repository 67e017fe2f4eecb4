// The floats of the differentiable tables that some parameters change.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "scene/tables.h"

namespace edgegrad {

// The differentiable tables (core/derivatives/table_derivatives.py).
enum class FloatTable : int32_t {
    kVertices,
    kNormals,
    kInstances,
    kFieldValues,
    kFieldPlaces,
    kClosures,
    kTexturePixels,
    kTextureAttributes,
    kTextureLookups,
    kTextureConstants,
    kLights,
    kEnvironment,
    kEnvironmentPixels,
    kEnvironmentRotation,
    kCamera,
    kMedia,
    kWorldMedium,
    kTables
};
extern const char* const kFloatTableNames[static_cast<size_t>(FloatTable::kTables)];
// Unknown names are an error (std::invalid_argument).
FloatTable float_table(std::string_view name);

// Floats [first, last) of a table.
struct FloatSpan {
    FloatTable table;
    size_t first, last;
};

// The columns (bits) that the floats [first, last) of a table of rows are in.
uint64_t columns_of(size_t first, size_t last, size_t width);

// Sorts spans by table and place, unites those that overlap or touch, and drops empty ones.
void unite(std::vector<FloatSpan>& spans);

// What each of some parameters changes: spans in any order, those of one parameter after those of another.
struct ParameterFloats {
    std::vector<FloatSpan> spans;
    std::vector<size_t> last;  // by parameter: the end of its spans
};

// Spans that `unite` has made, which must outlive this object.
class FloatSpans {
 public:
    FloatSpans(const SceneTables& tables, std::span<const FloatSpan> spans);

    bool empty() const { return spans_.empty(); }
    std::span<const FloatSpan> all() const { return spans_; }
    std::span<const FloatSpan> of(FloatTable table) const;
    // Whether floats of a table are requested, or are shading normals that follow requested vertices.
    bool any(FloatTable table) const { return tables_ & bit(table); }
    // Whether some of a table's floats [first, last) are requested.
    bool any(FloatTable table, size_t first, size_t last) const;
    // Whether no floats of other tables than these are, normals that follow vertices included.
    bool only(std::initializer_list<FloatTable> tables) const {
        uint32_t bits = 0;
        for (const FloatTable table : tables) bits |= bit(table);
        return (tables_ & ~bits) == 0;
    }
    // Whether anything but the strength of a light is requested.
    bool moves_lights() const;
    bool changes_media() const { return any(FloatTable::kMedia) || any(FloatTable::kWorldMedium); }
    bool moves_fields() const { return any(FloatTable::kFieldValues) || any(FloatTable::kFieldPlaces); }

 private:
    static constexpr uint32_t bit(FloatTable table) { return uint32_t{1} << static_cast<int32_t>(table); }

    std::span<const FloatSpan> spans_;
    uint32_t tables_ = 0;  // bits
};

// Calls visit(mesh) for the meshes with requested vertices until it returns true. Returns whether it has.
template <typename Visit>
bool any_moving_mesh(const SceneTables& tables, const FloatSpans& requested, const Visit& visit) {
    const std::vector<int32_t>& of = tables.mesh_first_vertex;
    for (const FloatSpan& s : requested.of(FloatTable::kVertices)) {
        // The first mesh that ends behind the start of the span
        const auto end = std::upper_bound(of.begin() + 1, of.end(), static_cast<int64_t>(s.first / 3));
        for (size_t mesh = static_cast<size_t>(end - of.begin()) - 1;
             mesh + 1 < of.size() && 3 * static_cast<size_t>(of[mesh]) < s.last; ++mesh)
            if (visit(mesh)) return true;
    }
    return false;
}

// Likewise for the distance fields of which coefficients or the place are requested.
template <typename Visit>
bool any_moving_field(const SceneTables& tables, const FloatSpans& requested, const Visit& visit) {
    if (!requested.moves_fields()) return false;
    size_t first = 0;
    for (size_t k = 0; k < tables.fields.size(); ++k) {
        const size_t next = first + tables.fields[k].values.size();
        if ((requested.any(FloatTable::kFieldValues, first, next) ||
             requested.any(FloatTable::kFieldPlaces, 12 * k, 12 * k + 12)) &&
            visit(k))
            return true;
        first = next;
    }
    return false;
}

// Likewise for the meshes with requested instances.
template <typename Visit>
bool any_mesh_of_instances(const SceneTables& tables, const FloatSpans& requested, const Visit& visit) {
    for (const FloatSpan& s : requested.of(FloatTable::kInstances)) {
        int32_t before = -1;  // instances are sorted by mesh
        for (size_t k = s.first / 12; k < tables.instance_mesh.size() && 12 * k < s.last; ++k) {
            const int32_t mesh = tables.instance_mesh[k];
            if (mesh != std::exchange(before, mesh) && visit(static_cast<size_t>(mesh))) return true;
        }
    }
    return false;
}

}  // namespace edgegrad
