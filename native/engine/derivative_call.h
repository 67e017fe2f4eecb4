// What both modes of the engine's derivatives prepare (engine/derivatives.cpp).
#pragma once

#include <optional>

#include "engine/call_scene.h"
#include "engine/decisions.h"
#include "engine/derivative_tables.h"
#include "engine/drop_count.h"
#include "engine/engine.h"
#include "engine/image_tasks.h"
#include "engine/terms/boundary_terms.h"
#include "engine/terms/edge_on_term.h"
#include "engine/terms/specular_term.h"
#include "engine/workspace.h"
#include "tasks/adjoint_task.h"
#include "tasks/dropped_samples.h"
#include "tasks/horizon_task.h"
#include "tasks/image_task.h"
#include "tasks/workspace_view.h"

namespace edgegrad {

// The scene, the interior term's chunks of the picture, and the boundary terms.
struct Engine::DerivativeCall {
    DerivativeCall(const Engine& e, const RenderOptions& options, const Requested& requested_of,
                   LearnedSampling* learned);
    // A sweep over paths whose vertices are then recorded.
    AdjointTask recording(const ImageTask& task, Workspace& work, AdjointWorkspace& adjoint,
                          const DifferentiableTables& of) const;
    // Renders a task's paths with their vertices; the task of sweeps over them.
    AdjointTask record(const ImageTask& task, Workspace& work, AdjointWorkspace& adjoint,
                       const DifferentiableTables& of) const;
    // The same of paths that look for rims of transmission lobes (path/rim.h).
    AdjointTask record_rims(const ImageTask& task, Workspace& work, AdjointWorkspace& adjoint,
                            const DifferentiableTables& of) const;
    // The same where light is a product and a sum of what is asked for.
    ValueTask record_values(const ImageTask& task, Workspace& work, AdjointWorkspace& adjoint,
                            const DifferentiableTables& of) const;
    // Whether rays that meet nothing bring what has a derivative: by itself, or since they turn.
    bool misses_change() const;
    // The horizon term's part of a task of its paths.
    HorizonTask horizon_task(const ImageTask& image, DroppedSamples& lost) const;
    // The samples and seconds of each part, once all are taken.
    void note_effort();
    // The part that stands for all that scan lines find.
    Part specular_part() const {
        return decided.computes(Part::kMirroredEdges)     ? Part::kMirroredEdges
               : decided.computes(Part::kMirroredShadows) ? Part::kMirroredShadows
                                                          : Part::kMirroredLight;
    }
    // How many samples each term took.
    void count_samples(LearnedSampling& learned) const;
    // What samples without a finite value were left out, by term.
    Dropped all_dropped() const;
    // Between the passes over the boundary terms' samples, whose variance is given: takes fewer samples of
    // the interior term where it has far less (engine/interior_pilot.cpp).
    void thin_interior(double boundary_variance, const Progress& progress,
                       std::vector<ThreadMemory>& of_thread);
    // A part of the interior term's samples instead of all.
    void divide_interior(int by);
    // Whether nothing but where vertices and the camera are is asked for.
    bool requests_motion_alone() const;
    bool may_thin_interior() const;
    void decide_interior(const RenderOptions& options);
    double interior_variance(const Progress& progress, std::vector<ThreadMemory>& of_thread) const;
    // Derivatives by strengths and colours are pictures: they, and what is asked for beside, have their
    // numbers.
    ImagePlan interior_plan(const RenderOptions& options) const;
    // What boundary terms read or write; null where it is not asked for.
    DerivativeView boundary_view(const GradientGroups::View& v) const {
        const auto first = static_cast<int32_t>(requested.span("vertices").first / 3);
        return {v.vertices, first,         v.camera,         v.instances,   v.lights,
                v.rotation, motion.camera, motion.instances, motion.lights, motion.rotation};
    }

    const Engine& engine;
    const Requested& requested;
    const std::vector<int8_t> sides;
    Decisions decided;
    mutable PartClock clock;
    const RequestedMotion motion;
    const bool geometry;  // whether positions, directions or normals of a path's vertices change
    const std::shared_ptr<const LightList> lights;
    const PreparedScene prepared;
    const SceneView& scene;
    ImagePlan plan;
    const ImagePlan horizon, rims;
    const std::vector<NamedTable> tables;
    const std::vector<int32_t> passed;  // TransparentClosure bits by leaf; empty: none
    const RequestedSurfaces surfaces;
    const bool values_alone, learns;
    std::vector<BoundaryTerm> terms;
    std::optional<SpecularTerm> specular;
    std::optional<EdgeOnTerm> edge_on;
    bool divided = false;  // the interior term takes fewer samples
    int64_t image_chunks = 0, horizon_chunks = 0, rim_chunks = 0, boundary_chunks = 0;
    mutable DropCount dropped;           // by the interior term
    mutable DropCount dropped_horizons;  // by the horizon term
    mutable DropCount dropped_chains;    // by the specular one
};

}  // namespace edgegrad
