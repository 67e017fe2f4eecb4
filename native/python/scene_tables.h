// Reads a scene's tables (core/tables/) from Python into native ones, and checks their sizes and indices.
#pragma once

#include <nanobind/nanobind.h>

#include "scene/tables.h"

namespace edgegrad {

// All tables. Coefficients of fields are not copied: they stay in the arrays that `tables` holds. Raises
// std::invalid_argument where sizes or indices disagree.
SceneTables read_tables(nanobind::handle tables);

// Those of materials, lights, the camera and the film, which change without a new BVH.
void read_values(nanobind::handle tables, ValueTables& values);

CameraView read_camera(nanobind::handle tables);

}  // namespace edgegrad
