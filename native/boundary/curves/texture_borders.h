// Borders within faces at which textures jump, as the camera sees them.
//
// The camera's rays keep their places in the picture, so that a moving surface carries such a border over
// them. At later vertices of paths, which move with their surfaces, nothing jumps.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "boundary/curves/candidates.h"
#include "boundary/curves/intersections.h"
#include "scene/textures/jumps.h"

namespace edgegrad {

// The jumps of all materials, which are kept.
std::shared_ptr<const MaterialJumps> kept_jumps(const SceneTables& tables, EdgeCache& kept);

// Borders of one face in one coordinate; cells of more are too narrow for rays beside their borders. And
// borders of all faces and instances together.
constexpr int32_t kMostFaceBorders = 2048;
constexpr int64_t kMostBorders = int64_t{1} << 20;

// Meshes that camera rays can hit, that move relative to them, and whose textures jump within faces.
struct JumpingMeshes {
    std::vector<int32_t> sampled;   // along the borders of grids of cells (scene/textures/jumps.h)
    std::vector<int32_t> left_out;  // at least in part: they jump elsewhere, in too many cells, or on fields
};
// They are kept for the last motion.
std::shared_ptr<const JumpingMeshes> jumping_meshes(const SceneTables& tables, const RequestedMotion& motion,
                                                    EdgeCache& kept);

// The borders on some meshes and their instances: lines whose two surfaces are the same face.
Intersections texture_borders(const EdgeList& edges, const std::vector<int32_t>& meshes);

}  // namespace edgegrad
