// Bindings of textures.
#pragma once

#include <nanobind/nanobind.h>

#include "scene/textures/texture_tables.h"

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

// Reads the TextureTables of core/tables/textures/program.py. Throws std::invalid_argument for tables that
// its compiler could not have written.
TextureTables read_textures(nanobind::handle tables, SharedColumns& columns);
TextureTables read_textures(nanobind::handle tables);

// Adds texture_operations and evaluate_textures to the module.
void bind_textures(nanobind::module_& module);

}  // namespace edgegrad
