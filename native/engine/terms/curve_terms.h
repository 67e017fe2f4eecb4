// Boundary terms of curves that are no edges: lines along which surfaces pass through others that give or
// scatter light, borders of spots without blend, and outlines of lights that the camera sees.
#pragma once

#include <memory>
#include <vector>

#include "boundary/curves/candidates.h"
#include "boundary/curves/intersections.h"
#include "engine/decisions.h"
#include "engine/engine.h"
#include "tasks/boundary_kind.h"

namespace edgegrad {

struct CurveTerm {
    BoundaryKind kind;
    Candidates candidates;
    std::shared_ptr<const EdgesAndIntersections> lines;  // null: about lights
    double share;                                        // samples per pixel and sample of the picture
};

// Those that `decided` computes, which is told what was found. `seen`: the intersections that the camera
// sees, where they have been looked for.
std::vector<CurveTerm> curve_terms(const SceneView& scene, const EdgeList& edges,
                                   const RenderOptions& options, const RequestedMotion& motion,
                                   const Intersections* seen, Decisions& decided);

}  // namespace edgegrad
