// The differentiable tables of a call: requested spans of floats, tangents and gradients.
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "engine/float_spans.h"
#include "scene/differentiable_tables.h"
#include "scene/tables.h"
#include "util/object_pool.h"
#include "util/zeroed_memory.h"

namespace edgegrad {

// Tangents or gradients of whole tables.
using TableValues = std::map<FloatTable, Zeros>;

// A table in the memory that kernels read through a scene's view.
struct NamedTable {
    FloatTable table;
    const float* data;  // null for those of distance fields
    size_t size;
};
std::vector<NamedTable> differentiable_tables(const SceneView& scene, const SceneTables& tables);

// The requested derivatives of a call.
class Requested {
 public:
    // Where vertices move, so do the shading normals that follow them.
    Requested(const SceneTables& tables, std::vector<FloatSpan> spans);
    Requested(const Requested&) = delete;
    Requested& operator=(const Requested&) = delete;

    // The requested floats, without the normals that follow vertices.
    const FloatSpans& floats() const { return floats_; }
    bool any(FloatTable table) const { return spans_.contains(table); }
    // Whether some of a table's floats [first, last) are requested.
    bool any(FloatTable table, size_t first, size_t last) const { return floats_.any(table, first, last); }
    // Whether anything but the strength of a light is requested.
    bool moves_lights() const { return floats_.moves_lights(); }
    // Whether positions, directions or normals of anything change.
    bool geometry() const;
    // Whether only strengths of lights and colours of Lambertian surfaces are requested, in which radiance is
    // multilinear (tasks/records/value_record.h).
    bool values_alone(const SceneView& scene) const;
    // The smallest span of floats that contains all requested floats of a table. For tables of rows
    // (closures, lights, the environment) the span consists of whole rows, with the requested columns as
    // bits.
    struct Span {
        size_t first = 0, last = 0;
        int32_t width = 1;
        uint64_t columns = 1;
    };
    Span span(FloatTable table) const;
    // Columns [first, last) as bits.
    static constexpr uint64_t columns(int first, int last) {
        return (uint64_t{1} << last) - (uint64_t{1} << first);
    }
    const std::map<FloatTable, Span>& spans() const { return spans_; }
    // By mesh: whether its vertices are requested.
    const std::vector<uint8_t>& moving() const { return moving_; }
    // By distance field: whether its coefficients or its place are requested.
    const std::vector<uint8_t>& moving_fields() const { return moving_fields_; }
    // Whether what textures compute is requested.
    bool textures() const {
        return any(FloatTable::kTexturePixels) || any(FloatTable::kTextureAttributes) ||
               any(FloatTable::kTextureLookups) || any(FloatTable::kTextureConstants);
    }
    bool moves_fields() const { return floats_.moves_fields(); }

 private:
    std::vector<FloatSpan> requested_;
    FloatSpans floats_;
    std::map<FloatTable, Span> spans_;
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
