// Boundary terms of curves other than edges: intersection curves of surfaces that emit or scatter light,
// borders of spots without blend, outlines of lights that the camera sees, and curves on distance fields.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "boundary/curves/candidates.h"
#include "boundary/curves/intersections.h"
#include "engine/decisions/decisions.h"
#include "tasks/boundary_kind.h"
#include "tasks/render_options.h"

namespace edgegrad {

struct CurveTerm {
    using Lines = std::shared_ptr<const EdgesAndIntersections>;
    CurveTerm(BoundaryKind its_kind, std::shared_ptr<const Candidates> all, Lines its_lines)
        : kind(its_kind), candidates(std::move(all)), lines(std::move(its_lines)) {}
    CurveTerm(BoundaryKind its_kind, Candidates all, Lines its_lines)
        : CurveTerm(its_kind, std::make_shared<const Candidates>(std::move(all)), std::move(its_lines)) {}

    BoundaryKind kind;
    std::shared_ptr<const Candidates> candidates;
    Lines lines;  // null: curves about lights
};

// The curve terms that `decided` computes. `seen`: the intersections that the camera sees, if they are known.
std::vector<CurveTerm> curve_terms(const SceneView& scene, const EdgeList& edges,
                                   const RenderOptions& options, const RequestedMotion& motion,
                                   const Intersections* seen, Decisions& decided);

}  // namespace edgegrad
