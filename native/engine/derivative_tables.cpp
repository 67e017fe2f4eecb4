#include "engine/derivative_tables.h"

#include <algorithm>
#include <array>
#include <bit>
#include <stdexcept>

#include "util/parallel.h"

namespace edgegrad {

std::vector<NamedTable> differentiable_tables(const SceneView& scene, const SceneTables& t) {
    const auto table = [](FloatTable name, const std::vector<float>& values) {
        return NamedTable{name, values.data(), values.size()};
    };
    const auto shared = [](FloatTable name, const SharedFloats& values) {
        return NamedTable{name, values.data(), values.size()};
    };
    std::vector<NamedTable> all = {
        table(FloatTable::kVertices, t.vertices),
        table(FloatTable::kNormals, t.normals),
        table(FloatTable::kInstances, t.instance_to_world),
        table(FloatTable::kClosures, t.closure_params),
        shared(FloatTable::kTexturePixels, t.textures.pixels),
        shared(FloatTable::kTextureAttributes, t.textures.attributes),
        table(FloatTable::kTextureLookups, t.textures.lookups),
        table(FloatTable::kTextureConstants, t.textures.constants),
        table(FloatTable::kLights, t.lights.params),
        {FloatTable::kEnvironment, scene.environment, 3},
        {FloatTable::kEnvironmentRotation, scene.environment_rotation, 9},
        {FloatTable::kCamera, scene.camera.position, kCameraFloats},
        table(FloatTable::kMedia, t.media),
        {FloatTable::kWorldMedium, scene.world_medium, kMediumFloats},
    };
    if (scene.environment_image.pixels)
        all.push_back({FloatTable::kEnvironmentPixels, scene.environment_image.pixels,
                       3 * static_cast<size_t>(scene.environment_image.width) *
                           static_cast<size_t>(scene.environment_image.height)});
    // Sweeps find these by their fields, not by addresses (sdf/field_derivatives.h).
    size_t coefficients = 0;
    for (const FieldTable& field : t.fields) coefficients += field.values.size();
    all.push_back({FloatTable::kFieldValues, nullptr, coefficients});
    all.push_back({FloatTable::kFieldPlaces, nullptr, 12 * t.fields.size()});
    return all;
}

namespace {

// Adds the requested span of a table, with the gradient or tangent of the span.
void add_span(DifferentiableTables& to, const NamedTable& table, const Requested::Span& span,
              double* gradient, const double* tangent, uint8_t* met = nullptr) {
    if (table.data) {
        to.add(table.data, table.size, span.first, span.last, span.width, span.columns, gradient, tangent);
        return;
    }
    FieldDerivatives::Span& fields =
        table.table == FloatTable::kFieldValues ? to.fields.values : to.fields.places;
    fields = {static_cast<int64_t>(span.first), static_cast<int64_t>(span.last), gradient, tangent, met};
}

// Number of floats per row, for tables whose columns are requested separately.
size_t row_width(FloatTable table) {
    if (table == FloatTable::kClosures) return kMaterialParams;
    if (table == FloatTable::kEnvironment) return 3;
    if (table == FloatTable::kMedia || table == FloatTable::kWorldMedium) return kMediumFloats;
    return table == FloatTable::kLights ? kLightParams : 1;
}

}  // namespace

Requested::Requested(const SceneTables& tables, std::vector<FloatSpan> spans)
    : requested_((unite(spans), std::move(spans))),
      floats_(tables, requested_),
      moving_(tables.mesh_first_vertex.size() - 1, 0),
      moving_fields_(tables.fields.size(), 0) {
    const auto add = [this](FloatTable table, size_t first, size_t last) {
        if (first >= last) return;
        const size_t width = row_width(table);
        Span span{first / width * width, (last + width - 1) / width * width, static_cast<int32_t>(width),
                  columns_of(first, last, width)};
        const auto [at, is_new] = spans_.try_emplace(table, span);
        if (is_new) return;
        Span& all = at->second;
        all.first = std::min(all.first, span.first), all.last = std::max(all.last, span.last);
        all.columns |= span.columns;
    };
    for (const FloatSpan& s : requested_) {
        // Boundary terms index these tables from their start.
        if (s.table == FloatTable::kCamera)
            add(s.table, 0, kCameraFloats);
        else if (s.table == FloatTable::kFieldPlaces)  // blocks add to whole maps
            add(s.table, s.first / 12 * 12, (s.last + 11) / 12 * 12);
        else if (s.table == FloatTable::kInstances)
            add(s.table, 0, tables.instance_to_world.size());
        else
            add(s.table, s.first, s.last);
    }
    if (const auto rows = spans_.find(FloatTable::kLights); rows != spans_.end())
        rows->second.first = 0, rows->second.last = tables.lights.params.size();
    any_moving_field(tables, floats_, [&](size_t k) {
        moving_fields_[k] = 1;
        return false;
    });
    any_moving_mesh(tables, floats_, [&](size_t m) {
        moving_[m] = 1;
        if (m + 1 < tables.mesh_first_normal.size() && !tables.mesh_custom[m])
            add(FloatTable::kNormals, 3 * static_cast<size_t>(tables.mesh_first_normal[m]),
                3 * static_cast<size_t>(tables.mesh_first_normal[m + 1]));
        return false;
    });
}

bool Requested::geometry() const {
    constexpr std::array geometric = {FloatTable::kVertices,           FloatTable::kNormals,
                                      FloatTable::kInstances,          FloatTable::kCamera,
                                      FloatTable::kFieldValues,        FloatTable::kFieldPlaces,
                                      FloatTable::kEnvironmentRotation};
    return moves_lights() ||
           std::any_of(geometric.begin(), geometric.end(), [this](FloatTable table) { return any(table); });
}

bool Requested::values_alone(const SceneView& scene) const {
    constexpr uint64_t color = columns(kBaseColor, kBaseColor + 3),
                       emission = columns(kEmission, kEmission + 3);
    const bool known = std::all_of(spans_.begin(), spans_.end(), [](const auto& span) {
        return span.first == FloatTable::kClosures || span.first == FloatTable::kLights ||
               span.first == FloatTable::kEnvironment;
    });
    if (!known || geometry() || (scene.all_flags & kHasAbsorption)) return false;
    const Span rows = span(FloatTable::kClosures);
    if (!any(FloatTable::kClosures)) return true;
    if ((rows.columns & ~(color | emission)) != 0) return false;
    if ((rows.columns & emission) != 0 && scene.emission_varies) return false;
    for (size_t k = rows.first; k < rows.last; k += kMaterialParams)
        if (any(FloatTable::kClosures, k + kBaseColor, k + kBaseColor + 3) &&
            !(scene.closure_flags[k / kMaterialParams] & kLambertian))
            return false;
    return true;
}

Requested::Span Requested::span(FloatTable table) const {
    const auto at = spans_.find(table);
    return at == spans_.end() ? Span{} : at->second;
}

// The largest number of floats of all groups together, unless a single group has more. Four groups of a very
// large texture would not fit in memory.
constexpr size_t kMostFloats = size_t{1} << 29;
// Larger buffers are not kept for later calls.
constexpr size_t kMostSpare = size_t{1} << 26;

GradientGroups::GradientGroups(std::vector<NamedTable> tables, const Requested& requested, ZeroedPool& spare)
    : spare_(spare) {
    size_t known = 0;
    for (const NamedTable& table : tables) {
        if (!requested.any(table.table)) continue;
        const Requested::Span span = requested.span(table.table);
        if (span.last > table.size)
            throw std::invalid_argument(std::string("more of the table '") +
                                        kFloatTableNames[static_cast<size_t>(table.table)] +
                                        "' is asked for than it has");
        parts_.push_back({table, span, size_, table.table == FloatTable::kFieldValues});
        size_ += span.last - span.first;
        ++known;
    }
    if (known != requested.spans().size())
        throw std::invalid_argument("a table that is asked for doesn't exist");
    // Many groups balance the load, but each costs memory to clear and to sum. A power of two is shared
    // evenly by as many threads: 13 groups of 300,000 floats took two of them 1.1 times as long as 8 do.
    const size_t size = std::max<size_t>(size_, 1);
    const size_t least = std::clamp<size_t>(kMostFloats / size, 1, 4);
    groups_.resize(std::bit_floor(std::clamp<size_t>((size_t{1} << 22) / size, least, 32)));
    met_.resize(groups_.size());
}

GradientGroups::View GradientGroups::view(int64_t group) {
    auto& values = groups_[static_cast<size_t>(group)];
    values = spare_.take();
    if (group == 0 && summed_in_place()) values->reserve(parts_[0].table.size);
    values->resize(size_);
    for (const Part& p : parts_)
        if (p.of_fields)
            met_[static_cast<size_t>(group)].assign(
                ((p.span.last - p.span.first) >> FieldDerivatives::Span::kPage) + 1, 0);
    return again(group);
}

bool GradientGroups::summed_in_place() const {
    constexpr size_t kPadding = 64;
    return size_ > kMostSpare && parts_.size() == 1 && parts_[0].span.first == 0 &&
           parts_[0].table.size <= size_ + kPadding;
}

GradientGroups::View GradientGroups::again(int64_t group) {
    double* const values = groups_[static_cast<size_t>(group)]->data();
    View v{{}, nullptr, nullptr, nullptr, nullptr, nullptr};
    for (const Part& p : parts_) {
        add_span(v.tables, p.table, p.span, values + p.offset, nullptr,
                 met_[static_cast<size_t>(group)].data());
        const std::pair<FloatTable, double**> singles[] = {{FloatTable::kVertices, &v.vertices},
                                                           {FloatTable::kCamera, &v.camera},
                                                           {FloatTable::kInstances, &v.instances},
                                                           {FloatTable::kLights, &v.lights},
                                                           {FloatTable::kEnvironmentRotation, &v.rotation}};
        for (const auto& [name, place] : singles)
            if (p.table.table == name) *place = values + p.offset;
    }
    return v;
}

TableValues GradientGroups::reduce(int threads) {
    TableValues out;
    const bool kept = size_ <= kMostSpare;
    const bool in_place = summed_in_place() && groups_[0] && groups_[0].use_count() == 1;
    for (const Part& p : parts_) {
        Zeros& sum = out[p.table.table];
        if (in_place) sum = std::move(*groups_[0]), groups_[0].reset();
        sum.resize(p.table.size);
        // The sums of a part fit in a core's cache. Memory is allocated in pages.
        constexpr size_t kPart = 1 << 13, kPage = size_t{1} << FieldDerivatives::Span::kPage;
        const size_t size = p.span.last - p.span.first;
        parallel_for(
            threads, static_cast<int64_t>((size + kPart - 1) / kPart), nullptr, [&](int, int64_t part) {
                const size_t begin = static_cast<size_t>(part) * kPart, end = std::min(size, begin + kPart);
                for (size_t g = 0; g < groups_.size(); ++g) {
                    if (!groups_[g]) continue;
                    double* const values = groups_[g]->data() + p.offset;
                    for (size_t at = begin; at < end; at += kPage) {
                        const size_t next = std::min(end, at + kPage);
                        // Samples meet few parts of a large texture or field. The other pages stay
                        // unallocated. Even to read them takes time, so that fields mark what was met.
                        if (p.of_fields
                                ? !met_[g][at / kPage]
                                : std::all_of(values + at, values + next, [](double x) { return x == 0.0; }))
                            continue;
                        for (size_t k = at; k < next; ++k) sum[p.span.first + k] += values[k];
                        // Cleared while in the cache: a separate loop would take as long as the sum.
                        if (kept) std::fill(values + at, values + next, 0.0);
                    }
                }
            });
    }
    for (auto& group : groups_)
        if (group && kept) spare_.give(std::move(group));
    return out;
}

DifferentiableTables with_tangents(const std::vector<NamedTable>& tables, const Requested& requested,
                                   const TableValues& tangents) {
    DifferentiableTables out;
    for (const NamedTable& table : tables) {
        if (!requested.any(table.table)) continue;
        const Requested::Span span = requested.span(table.table);
        const Zeros& tangent = tangents.at(table.table);
        if (tangent.size() != table.size)
            throw std::invalid_argument(std::string("the tangent of the table '") +
                                        kFloatTableNames[static_cast<size_t>(table.table)] +
                                        "' has the wrong size");
        add_span(out, table, span, nullptr, tangent.data() + span.first);
    }
    return out;
}

}  // namespace edgegrad
