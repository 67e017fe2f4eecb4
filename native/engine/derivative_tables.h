// The differentiable tables of a call: requested spans of floats, tangents and gradients.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "scene/differentiable_tables.h"
#include "scene/tables.h"
#include "util/object_pool.h"
#include "util/zeroed_memory.h"

namespace edgegrad {

// Tangents or gradients of whole tables, by name (core/derivatives/table_derivatives.py).
using TableValues = std::map<std::string, Zeros>;

// Floats [first, last) of a table.
struct TableSpan {
    std::string table;
    size_t first, last;
};

// A table in the memory that kernels read through a scene's view.
struct NamedTable {
    const char* name;
    const float* data;  // null for those of distance fields
    size_t size;
};
std::vector<NamedTable> differentiable_tables(const SceneView& scene, const SceneTables& tables);

// The requested derivatives of a call.
class Requested {
 public:
    // Spans of unknown tables are an error (std::invalid_argument). Where vertices move, so do the shading
    // normals that follow them.
    Requested(const SceneTables& tables, const std::vector<TableSpan>& spans);

    bool any(const std::string& table) const { return spans_.count(table) > 0; }
    // Whether some of a table's floats [first, last) are requested.
    bool any(const std::string& table, size_t first, size_t last) const;
    // The requested columns (bits) of one row of a table.
    uint64_t row_columns(const std::string& table, size_t row) const;
    // Whether anything but the strength of a light is requested.
    bool moves_lights() const;
    // Whether positions, directions or normals of anything change.
    bool geometry() const;
    // Whether only strengths of lights and colours of Lambertian surfaces are requested, in which radiance is
    // multilinear (tasks/value_record.h).
    bool values_alone(const SceneView& scene) const;
    // The smallest span of floats that contains all requested floats of a table. For tables of rows
    // (closures, lights, the environment) the span consists of whole rows, with the requested columns as
    // bits.
    struct Span {
        size_t first = 0, last = 0;
        int32_t width = 1;
        uint64_t columns = 1;
    };
    Span span(const std::string& table) const;
    // Columns [first, last) as bits.
    static constexpr uint64_t columns(int first, int last) {
        return (uint64_t{1} << last) - (uint64_t{1} << first);
    }
    const std::map<std::string, Span>& spans() const { return spans_; }
    // By mesh: whether its vertices are requested.
    const std::vector<uint8_t>& moving() const { return moving_; }
    // By distance field: whether its coefficients or its place are requested.
    const std::vector<uint8_t>& moving_fields() const { return moving_fields_; }
    // Whether what textures compute is requested.
    bool textures() const {
        return any("texture_pixels") || any("texture_attributes") || any("texture_lookups") ||
               any("texture_constants");
    }
    bool moves_fields() const { return any("field_values") || any("field_to_world"); }

 private:
    std::vector<TableSpan> requested_;
    std::map<std::string, Span> spans_;
    std::vector<uint8_t> moving_, moving_fields_;
};

// Buffers of zeros.
using ZeroedPool = ObjectPool<Zeros>;

// Gradient buffers, summed in a fixed order.
class GradientGroups {
 public:
    GradientGroups(std::vector<NamedTable> tables, const Requested& requested, ZeroedPool& spare);
    GradientGroups(const GradientGroups&) = delete;
    GradientGroups& operator=(const GradientGroups&) = delete;

    int64_t count() const { return static_cast<int64_t>(groups_.size()); }
    // A group's buffers, cleared; the pointers to single tables are null where they are not requested.
    struct View {
        DifferentiableTables tables;
        double *vertices, *camera, *instances, *lights, *rotation;
    };
    View view(int64_t group);
    // The same buffers with their values.
    View again(int64_t group);
    // The sum of all groups. May be called once; it gives the buffers back to the pool.
    TableValues reduce(int threads);

 private:
    struct Part {
        NamedTable table;
        Requested::Span span;
        size_t offset;
        bool of_fields;  // coefficients, whose met pages are known
    };
    // Whether the first group's buffer becomes the result, for a single large table.
    bool summed_in_place() const;

    std::vector<Part> parts_;
    size_t size_ = 0;
    std::vector<std::shared_ptr<Zeros>> groups_;  // null: the group had no work
    std::vector<std::vector<uint8_t>> met_;       // by group: FieldDerivatives::Span::met
    ZeroedPool& spare_;
};

// The requested tables with their tangents.
DifferentiableTables with_tangents(const std::vector<NamedTable>& tables, const Requested& requested,
                                   const TableValues& tangents);

}  // namespace edgegrad
