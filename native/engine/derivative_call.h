// What both modes of the engine's derivatives prepare (engine/derivatives.cpp).
#pragma once

#include <memory>
#include <vector>

#include "engine/call_scene.h"
#include "engine/decisions/decisions.h"
#include "engine/derivative_tables.h"
#include "engine/engine.h"
#include "engine/image_tasks.h"
#include "engine/terms/boundary_terms.h"
#include "engine/terms/edge_on_term.h"
#include "engine/terms/path_recording.h"
#include "engine/terms/path_terms.h"
#include "engine/terms/specular_term.h"
#include "engine/terms/term.h"
#include "engine/workspace.h"

namespace edgegrad {

enum class DerivativeMode { kForward, kReverse };

// The scene and the terms of a call. Terms that are zero are null.
struct Engine::DerivativeCall {
    DerivativeCall(const Engine& e, const RenderOptions& options, const Requested& requested_of,
                   LearnedSampling* learned, bool decide_alone = false);

    // Every term's passes, by visit(std::vector<TermPass>): first those that say where later ones take their
    // samples, then all others.
    template <typename Visit>
    void run(DerivativeMode mode, const Progress& pilot, std::vector<ThreadMemory>& memory,
             const Visit& visit) {
        visit(first_passes(mode));
        if (specular) specular->guide();
        thin_interior(guide_second_passes(boundaries), pilot, memory);
        visit(later_passes(mode));
    }
    std::vector<TermPass> first_passes(DerivativeMode mode) const;
    std::vector<TermPass> later_passes(DerivativeMode mode) const;
    // All that are not null, in the order of reports.
    std::vector<Term*> terms() const;
    int64_t chunks() const;

    // The samples and seconds of each part, once all are taken.
    void note_effort();
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
    // Whether nothing but where vertices and the camera are is requested.
    bool requests_motion_alone() const;
    bool may_thin_interior() const;
    double interior_variance(const Progress& progress, std::vector<ThreadMemory>& of_thread) const;
    // Derivatives by strengths and colours are pictures, whose random numbers they reuse, as what is
    // requested beside them does.
    ImagePlan interior_plan(const RenderOptions& options) const;
    // Whether any material has lobes that are worth pairs of mirrored samples.
    bool any_sharp_material() const;
    // Decides on the interior term and its rims; `own`: with their number of samples.
    void begin_interior(const RenderOptions& options, const RenderOptions& own);
    // Samples by area beside those of the interior term.
    void sample_edge_on_faces();
    // What boundary terms read or write; null where it is not requested.
    DerivativeView boundary_view(const GradientGroups::View& v) const {
        const auto first = static_cast<int32_t>(requested.span("vertices").first / 3);
        return {v.vertices, first,         v.camera,         v.instances,   v.lights,
                v.rotation, motion.camera, motion.instances, motion.lights, motion.rotation};
    }

    const Engine& engine;
    const Requested& requested;
    const std::vector<int8_t> sides;
    Decisions decided;
    PartClock clock;
    const RequestedMotion motion;
    const bool chains;    // whether edges move, or rays bend on their way (moves_chains)
    const bool geometry;  // whether positions, directions or normals of a path's vertices change
    const std::shared_ptr<const LightList> lights;
    const PreparedScene prepared;
    const SceneView& scene;
    const std::vector<NamedTable> tables;
    const PathRecording recording;
    const bool learns;
    std::unique_ptr<InteriorTerm> interior;
    std::unique_ptr<HorizonTerm> horizon;
    std::unique_ptr<RimTerm> rims;
    BoundaryTerms boundaries;
    std::unique_ptr<SpecularTerm> specular;
    std::unique_ptr<EdgeOnTerm> edge_on;
    bool divided = false;  // the interior term takes fewer samples
};

}  // namespace edgegrad
