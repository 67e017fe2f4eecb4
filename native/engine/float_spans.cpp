#include "engine/float_spans.h"

#include <iterator>
#include <stdexcept>
#include <string>
#include <tuple>

#include "scene/lights/light_params.h"

namespace edgegrad {

const char* const kFloatTableNames[] = {
    "vertices",       "normals",        "instance_to_world",  "field_values",         "field_to_world",
    "closure_params", "texture_pixels", "texture_attributes", "texture_lookups",      "texture_constants",
    "light_params",   "environment",    "environment_pixels", "environment_rotation", "camera",
    "media",          "world_medium"};

FloatTable float_table(std::string_view name) {
    const auto* at = std::find(std::begin(kFloatTableNames), std::end(kFloatTableNames), name);
    if (at == std::end(kFloatTableNames))
        throw std::invalid_argument("a table that is asked for doesn't exist: " + std::string(name));
    return static_cast<FloatTable>(at - std::begin(kFloatTableNames));
}

uint64_t columns_of(size_t first, size_t last, size_t width) {
    uint64_t columns = 0;
    for (size_t k = first; k < std::min(last, first + width); ++k) columns |= uint64_t{1} << (k % width);
    return columns;
}

void unite(std::vector<FloatSpan>& spans) {
    std::erase_if(spans, [](const FloatSpan& s) { return s.first >= s.last; });
    std::sort(spans.begin(), spans.end(), [](const FloatSpan& a, const FloatSpan& b) {
        return std::tie(a.table, a.first) < std::tie(b.table, b.first);
    });
    size_t kept = 0;
    for (const FloatSpan& s : spans)
        if (kept > 0 && spans[kept - 1].table == s.table && s.first <= spans[kept - 1].last)
            spans[kept - 1].last = std::max(spans[kept - 1].last, s.last);
        else
            spans[kept++] = s;
    spans.resize(kept);
}

FloatSpans::FloatSpans(const SceneTables& tables, std::span<const FloatSpan> spans) : spans_(spans) {
    for (const FloatSpan& s : spans) tables_ |= bit(s.table);
    const auto has_following_normals = [&](size_t mesh) {
        const std::vector<int32_t>& first = tables.mesh_first_normal;
        return mesh + 1 < first.size() && !tables.mesh_custom[mesh] && first[mesh] < first[mesh + 1];
    };
    if (any_moving_mesh(tables, *this, has_following_normals)) tables_ |= bit(FloatTable::kNormals);
}

std::span<const FloatSpan> FloatSpans::of(FloatTable table) const {
    if (!any(table)) return {};
    const auto found =
        std::equal_range(spans_.begin(), spans_.end(), FloatSpan{table, 0, 0},
                         [](const FloatSpan& a, const FloatSpan& b) { return a.table < b.table; });
    return {found.first, found.second};
}

bool FloatSpans::any(FloatTable table, size_t first, size_t last) const {
    const std::span<const FloatSpan> found = of(table);
    const auto next =
        std::partition_point(found.begin(), found.end(), [&](const FloatSpan& s) { return s.last <= first; });
    return next != found.end() && next->first < last;
}

bool FloatSpans::moves_lights() const {
    constexpr uint64_t radiance = ((uint64_t{1} << 3) - 1) << kLightRadiance;
    const std::span<const FloatSpan> rows = of(FloatTable::kLights);
    return std::any_of(rows.begin(), rows.end(), [](const FloatSpan& s) {
        return (columns_of(s.first, s.last, kLightParams) & ~radiance) != 0;
    });
}

}  // namespace edgegrad
