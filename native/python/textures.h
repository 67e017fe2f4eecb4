// Textures and Python.
#pragma once

#include <nanobind/nanobind.h>

#include "scene/textures/texture_tables.h"

namespace edgegrad {

// The tables of a core/tables/textures/program.py TextureTables. Throws std::invalid_argument for what no
// compiler of ours would have written.
TextureTables read_textures(nanobind::handle tables);

// Adds texture_operations and evaluate_textures to the module.
void bind_textures(nanobind::module_& module);

}  // namespace edgegrad
