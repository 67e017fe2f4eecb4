// Bindings of outlines and of surfaces of distance fields, for tests.
#pragma once

#include <nanobind/nanobind.h>

namespace edgegrad {

// The outline of a field, seen from a point, as arrays: `ends` (n, 2, 3) of the segments, and for each of the
// fractions `u` (m) of each segment `position` (n, m, 3), `tangent` (n, m, 3), and `sign` (n, m): 0 where
// there is no point, -1 where the outline runs back.
nanobind::dict field_outline_points(nanobind::handle values, nanobind::handle to_world,
                                    nanobind::handle viewer, nanobind::handle u, int threads);

// Points of the patches of a field's surface at the places (m, 2) of each, as arrays: `position` and `normal`
// (n, m, 3), and `area` (n, m), 0 where there is no point (sdf/surface_patch.h).
nanobind::dict field_surface_points(nanobind::handle values, nanobind::handle to_world,
                                    nanobind::handle places, int threads);

// The warp of the picture (reparameterisation/picture_warp.h) at perspective rays (n, 2, 3) of origins and
// directions of unit depth, which turn with the place in the picture by `across` (2, 3). Each has one near
// miss, near `depth` (n). As arrays: `apart` (n), `point` (n, 3), `step` (n, 2), `spread` (n), `along` (n,
// 3).
nanobind::dict field_warps(nanobind::handle values, nanobind::handle to_world, nanobind::handle rays,
                           nanobind::handle depth, nanobind::handle across, float pixels,
                           float least_curvature);

}  // namespace edgegrad
