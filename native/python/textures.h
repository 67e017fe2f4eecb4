// Textures and Python.
#pragma once

#include <nanobind/nanobind.h>

#include "texture/texture_tables.h"

namespace edgegrad {

// The last copy of a large array, and the array in Python that it is a copy of. The arrays of TextureTables
// never change, so that the copy of the same array is used again.
class SharedColumn {
 public:
    TextureTables::Shared read(nanobind::handle object, const char* name);

 private:
    nanobind::object array_;
    TextureTables::Shared copy_;
};
struct SharedColumns {
    SharedColumn pixels, attributes;
};

// The tables of a core/tables/textures/program.py TextureTables. Throws std::invalid_argument for what no
// compiler of ours would have written.
TextureTables read_textures(nanobind::handle tables, SharedColumns& columns);
TextureTables read_textures(nanobind::handle tables);

// Adds texture_operations and evaluate_textures to the module.
void bind_textures(nanobind::module_& module);

}  // namespace edgegrad
