// What the searches for parts that are not computed share: the facts of a call, and how a part is noted.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "boundary/curves/edge_cache.h"
#include "engine/decisions/decisions.h"

namespace edgegrad {

struct MissingSearch {
    const BoundaryFacts& facts;
    const SceneTables& tables;
    const RequestedMotion& motion;
    const Requested& requested;
    const std::vector<uint8_t>& closed;  // by mesh (boundary/meshes/solids.h)
    const int threads;
    EdgeCache& kept;
    Decisions& decided;
    const std::vector<uint8_t> moving;         // by mesh
    const std::vector<uint8_t> surface_moves;  // by mesh and field
    const bool any_moves;                      // anything that may move what is seen
    const bool chains_turn;                    // mirrors_turn (engine/decisions/mirrored_edges.h)

    MissingSearch(const BoundaryFacts& facts, const Requested& requested, const std::vector<uint8_t>& closed,
                  int threads, Decisions& decided);

    // Note a part, and the objects that it is about. Without objects it is not missing.
    Decision& miss(Part part, int64_t limit = 0) const;
    void meshes(Part part, std::vector<int32_t> found, int64_t limit = 0) const;
    void lights(Part part, std::vector<int32_t> found) const;
    void materials(Part part, std::vector<int32_t> found, int64_t limit = 0) const;
    // Lights that meshes pass through, of those pairs (row, mesh) that are wanted.
    void pierced(Part part, const std::function<bool(size_t, size_t)>& wanted) const;

    std::vector<int32_t> sized_lights(int32_t seen_by) const;
    // Whether anything but the strength of a light is requested.
    bool light_moves(int32_t row) const;
};

// Notes what is not computed of borders, edges and textures that the camera sees.
void miss_seen_parts(const MissingSearch& s);
// Notes what is not computed of shadows and jumps of light on surfaces, and of absorption.
void miss_lit_parts(const MissingSearch& s);
// Notes what distance fields lack.
void miss_field_parts(const MissingSearch& s);
// Notes what is not computed of mirrors, glass, caustics and rims of lobes.
void miss_mirrored_parts(const MissingSearch& s);

}  // namespace edgegrad
