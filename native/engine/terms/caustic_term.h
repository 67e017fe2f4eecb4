// The terms of outlines of lights and of edges in caustics (boundary/caustics/caustic_path.h).
#pragma once

#include "engine/terms/boundary_terms.h"
#include "engine/terms/found_edges.h"

namespace edgegrad {

// The least part of the samples of a second pass. Mirrors and glass magnify motions, which the size of a
// sample does not contain. Of edges, most scenes have none that matter.
constexpr double least_of_caustics(BoundaryKind kind) {
    return kind == kCausticOutline ? 0.25 : kind == kCausticEdge ? 0.0625 : 0.0;
}

// Add terms of so many samples, if there is something to sample. `lit_mirrors` and `mirrors`: faces by the
// light that they may receive, and by area (boundary/curves/mirror_faces.h). `beams`: at whose lights samples
// aim; null: at none.
void add_caustic_outlines(BoundaryTerms& terms, const RenderOptions& options, const Candidates& lit_mirrors,
                          double samples);
void add_caustic_edges(BoundaryTerms& terms, const SceneView& scene, const EdgeList& edges,
                       const RenderOptions& options, const FoundEdges& found, double samples,
                       const SharedCandidates& mirrors, const std::shared_ptr<const LightBeams>& beams);

}  // namespace edgegrad
