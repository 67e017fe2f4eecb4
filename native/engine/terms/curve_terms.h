// Boundary terms of curves other than edges: intersection curves of surfaces that emit or scatter light,
// borders of spots without blend, outlines of lights that the camera sees, and curves on distance fields.
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
    std::shared_ptr<const EdgesAndIntersections> lines;  // null: curves about lights
};

// The curve terms that `decided` computes. `seen`: the intersections that the camera sees, if they are known.
std::vector<CurveTerm> curve_terms(const SceneView& scene, const EdgeList& edges,
                                   const RenderOptions& options, const RequestedMotion& motion,
                                   const Intersections* seen, Decisions& decided);

}  // namespace edgegrad
