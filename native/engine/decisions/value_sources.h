// What the values of a closure depend on: numbers of its row, and texture programs that replace them.
#pragma once

#include "engine/derivative_tables.h"
#include "scene/view.h"

namespace edgegrad {

struct ValueSources {
    bool programs = false;   // a texture program computes some of the values
    bool requested = false;  // some value depends on a requested number, texel, table or attribute
};

// Whether a program's step itself reads requested numbers, texels, tables or attributes.
bool reads_requested(const TextureView& textures, const Requested& requested, const TextureInstruction& step);

// The sources of some columns (bits) of a closure's row.
ValueSources value_sources(const SceneView& scene, const Requested& requested, size_t closure,
                           uint64_t columns);

}  // namespace edgegrad
