// Bindings of textures.
#pragma once

#include <nanobind/nanobind.h>

#include "scene/textures/texture_tables.h"

namespace edgegrad {

// Reads the TextureTables of core/tables/textures/texture_tables.py. Throws std::invalid_argument for tables
// that its compiler could not have written. Its pixels and attributes stay in Python's memory: the arrays of
// TextureTables never change.
TextureTables read_textures(nanobind::handle tables);

// Adds texture_operations and evaluate_textures to the module.
void bind_textures(nanobind::module_& module);

}  // namespace edgegrad
