// The tables that a call's derivatives are taken of: by name, in spans of floats.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "scene/differentiable_tables.h"
#include "scene/tables.h"
#include "util/object_pool.h"
#include "util/parallel.h"
#include "util/zeroed_memory.h"

namespace edgegrad {

// Tangents or gradients of whole tables, by name (core/derivatives/table_derivatives.py).
using TableValues = std::map<std::string, Zeros>;

// Floats [first, last) of a table.
struct TableSpan {
    std::string table;
    size_t first, last;
};

// Places of the tables that kernels read through a scene's view.
struct NamedTable {
    const char* name;
    const float* data;
    size_t size;
};
std::vector<NamedTable> differentiable_tables(const SceneView& scene, const SceneTables& tables);

// What a call is asked for.
class Requested {
 public:
    // Spans of unknown tables are an error (std::invalid_argument). Where vertices move, so do the shading
    // normals that follow them.
    Requested(const SceneTables& tables, const std::vector<TableSpan>& spans);

    bool any(const std::string& table) const { return spans_.count(table) > 0; }
    // Whether some of a table's floats [first, last) are asked for.
    bool any(const std::string& table, size_t first, size_t last) const;
    // Whether more of a light than its strength changes.
    bool moves_lights() const;
    // Whether positions, directions or normals of anything change.
    bool geometry() const;
    // Whether nothing but strengths of lights and colours of surfaces that scatter like Lambert's changes, of
    // which light is a product and a sum (tasks/value_record.h).
    bool values_alone(const SceneView& scene) const;
    // The one span that holds all of a table that is asked for, floats. Shaders and lights are rows, and the
    // environment is one: their spans are of whole ones, of which only some columns (bits) are asked for.
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
    // By mesh: its vertices.
    const std::vector<uint8_t>& moving() const { return moving_; }

 private:
    std::vector<TableSpan> requested_;
    std::map<std::string, Span> spans_;
    std::vector<uint8_t> moving_;
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
    // A group's buffers, cleared; those of single tables are null where they are not asked for.
    struct View {
        DifferentiableTables tables;
        double *vertices, *camera, *instances, *lights, *rotation;
    };
    View view(int64_t group);
    // The same buffers with what is in them.
    View again(int64_t group);
    // Their sum; once, after which the buffers are spare.
    TableValues reduce(int threads);

 private:
    struct Part {
        NamedTable table;
        Requested::Span span;
        size_t offset;
    };
    // Whether the first group's buffer becomes the result: of a large table that is alone.
    bool summed_in_place() const;

    std::vector<Part> parts_;
    size_t size_ = 0;
    std::vector<std::shared_ptr<Zeros>> groups_;  // null: no work has come to it
    ZeroedPool& spare_;
};

// The tables with their tangents.
DifferentiableTables with_tangents(const std::vector<NamedTable>& tables, const Requested& requested,
                                   const TableValues& tangents);

}  // namespace edgegrad
