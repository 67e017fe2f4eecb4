// Boundary terms of curves that are no edges: intersection curves of surfaces that give or scatter light,
// borders of spots without blend, and outlines of lights that the camera sees.
#pragma once

#include <memory>
#include <vector>

#include "boundary/curves/candidates.h"
#include "boundary/curves/intersections.h"
#include "engine/decisions/decisions.h"
#include "tasks/boundary_kind.h"
#include "tasks/render_options.h"

namespace edgegrad {

struct CurveTerm {
    BoundaryKind kind;
    Candidates candidates;
    std::shared_ptr<const EdgesAndIntersections> lines;  // null: about lights
};

// Those that the options name and that may not be zero. `seen`: the intersections that the camera sees, where
// they have been looked for.
std::vector<CurveTerm> curve_terms(const SceneView& scene, const EdgeList& edges,
                                   const RenderOptions& options, const RequestedMotion& motion,
                                   const Intersections* seen, Decisions& decided);

}  // namespace edgegrad
