// Curves and patches of distance fields that boundary terms sample, as lines of a scene
// (boundary/curves/intersections.h). The first surface of each line is the face that stands for its field.
// Results are kept as long as fields, viewers and lights stay as they are.
#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "boundary/curves/candidates.h"
#include "boundary/curves/intersections.h"
#include "sdf/carrier/carrier.h"

namespace edgegrad {

// The carriers of all fields, which are kept.
std::shared_ptr<const std::vector<FieldCarrier>> field_carriers(const SceneTables& tables, EdgeCache& kept,
                                                                int threads);

// The outlines of the fields of some meshes, as the camera sees them: with depth of field from some points of
// the lens, which `seed` chooses.
std::shared_ptr<const Intersections> seen_outlines(const SceneView& scene, const EdgeList& edges,
                                                   const std::vector<int32_t>& meshes, uint32_t seed);

// Lines, and all of them as candidates by their weights.
struct FieldLines {
    EdgesAndIntersections lines;
    Candidates all;
    // The candidates in cells of directions, as the last call wanted them (boundary/curves/segment_cells.h).
    // Key: about how many cells, and whether there are chains.
    using InCells = Kept<std::pair<double, bool>, Candidates>;
    std::unique_ptr<InCells> in_cells = std::make_unique<InCells>();
};

// The outlines as all lights without size see them. The second surface of a line is its light.
std::shared_ptr<const FieldLines> lit_outlines(const SceneView& scene, const EdgeList& edges,
                                               const std::vector<int32_t>& meshes);

// Patches of the surfaces of fields, weighted by an estimate of how large the contribution of the lines is
// that touch them: towards lights with a size, or in all directions. Left out are patches that are certainly
// not touched by lines outside of the surface or towards such lights.
enum class TouchedBy { kSizedLights, kAllDirections };
std::shared_ptr<const FieldLines> field_patches(const SceneView& scene, const EdgeList& edges,
                                                const std::vector<int32_t>& meshes, TouchedBy by);

}  // namespace edgegrad
