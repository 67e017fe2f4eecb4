#include "engine/decisions/missing/missing_search.h"

#include <utility>

#include "boundary/curves/light_intersections.h"
#include "engine/decisions/mirrored_edges.h"
#include "scene/lights/light_params.h"

namespace edgegrad {

MissingSearch::MissingSearch(const BoundaryFacts& given, const Requested& rows,
                             const std::vector<uint8_t>& solids, int count, Decisions& out)
    : facts(given),
      tables(given.tables),
      motion(given.motion),
      requested(rows),
      closed(solids),
      threads(count),
      kept(given.kept),
      decided(out),
      moving(moving_meshes(given.tables, given.motion)),
      surface_moves(moving_surfaces(given.tables, given.motion)),
      any_moves(motion.camera || motion.lights || motion.rotation || motion.any_mesh_moves() ||
                motion.any_field_moves()),
      chains_turn(mirrors_turn(given)) {}

Decision& MissingSearch::miss(Part part, int64_t limit) const {
    Decision& found = decided.missing(part);
    found.limit = limit;
    return found;
}

void MissingSearch::meshes(Part part, std::vector<int32_t> found, int64_t limit) const {
    if (!found.empty()) miss(part, limit).meshes = std::move(found);
}

void MissingSearch::lights(Part part, std::vector<int32_t> found) const {
    if (!found.empty()) miss(part).lights = std::move(found);
}

void MissingSearch::materials(Part part, std::vector<int32_t> found, int64_t limit) const {
    if (!found.empty()) miss(part, limit).materials = std::move(found);
}

void MissingSearch::pierced(Part part, const std::function<bool(size_t, size_t)>& wanted) const {
    const Intersections lines = lines_through_lights(tables, wanted, threads);
    if (lines.size() == 0) return;
    miss(part);
    decided.found(part, tables, lines);
}

std::vector<int32_t> MissingSearch::sized_lights(int32_t seen_by) const {
    std::vector<int32_t> out;
    for (size_t row = 0; row < tables.lights.kind.size(); ++row)
        if (is_sized(tables.lights.kind[row]) && (tables.lights.visible_to[row] & seen_by))
            out.push_back(static_cast<int32_t>(row));
    return out;
}

bool MissingSearch::light_moves(int32_t row) const {
    const size_t first = kLightParams * static_cast<size_t>(row);
    return requested.any(FloatTable::kLights, first + kLightPosition, first + kLightParams);
}

}  // namespace edgegrad
