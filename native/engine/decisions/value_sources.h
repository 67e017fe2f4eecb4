// What the values of a closure depend on: numbers of its row, and texture programs that replace them.
#pragma once

#include <functional>

#include "engine/derivative_tables.h"
#include "scene/view.h"

namespace edgegrad {

struct ValueSources {
    bool programs = false;   // a texture program computes some of the values
    bool requested = false;  // some value depends on a requested number, texel, table or attribute
};

using VisitFloats = std::function<void(const FloatSpan&)>;

// Whether a program's step itself reads requested numbers, texels, tables or attributes.
bool reads_requested(const TextureView& textures, const Requested& requested, const TextureInstruction& step);

// Visits the floats on which some columns (bits) of a closure's row depend, some of them several times.
// Returns whether a texture program computes some of the columns.
bool visit_sources(const SceneView& scene, size_t closure, uint64_t columns, const VisitFloats& visit);

// The sources of some columns (bits) of a closure's row.
ValueSources value_sources(const SceneView& scene, const Requested& requested, size_t closure,
                           uint64_t columns);

}  // namespace edgegrad
