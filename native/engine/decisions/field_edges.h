// Which estimator takes the outlines of distance fields that the camera sees, and its bands.
#pragma once

#include <vector>

#include "engine/derivative_tables.h"
#include "scene/tables.h"
#include "sdf/field_band.h"
#include "tasks/render_options.h"

namespace edgegrad {

// The estimator that a call uses: that of the options, or outlines where it does not cover the scene.
FieldEdges used_field_edges(const SceneTables& tables, const RenderOptions& options,
                            const Requested& requested);

// The bands of all fields that the camera sees; empty if the estimator needs none.
std::vector<FieldBand> field_bands(const SceneTables& tables, FieldEdges edges, int threads);

}  // namespace edgegrad
