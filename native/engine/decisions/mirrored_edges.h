// Decisions on edges and outlines of lights that the camera sees by mirrors, smooth glass and followed lobes.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/decisions/decisions.h"

namespace edgegrad {

// By material, 1 or 0: whether it may throw light on other surfaces by perfect lobes, or by mirrors and coats
// with an alpha up to `thrown`.
std::vector<uint8_t> throwing_materials(const SceneTables& tables, float thrown);

// The largest number of their faces, of all instances, of which caustics are computed: samples list them.
constexpr int64_t kMostMirrorFaces = int64_t{1} << 22;
// Whether there are more, counting all faces of their meshes.
bool too_many_throw(const SceneTables& tables, float thrown);

// Whether rays turn that mirrors, smooth glass and followed lobes show. Else what they show of still things
// is still.
bool mirrors_turn(const BoundaryFacts& facts);
// `partly_met`: meshes that only some kinds of scattered rays can hit.
void decide_mirrored(const BoundaryFacts& facts, const std::vector<int32_t>& partly_met, Decisions& decided);
// Decides on outlines of lights and edges in light that mirrors and smooth glass throw on other surfaces.
void decide_caustics(const BoundaryFacts& facts, const std::vector<int32_t>& partly_met, Decisions& decided);

}  // namespace edgegrad
