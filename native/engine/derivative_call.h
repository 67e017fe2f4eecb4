// The preparation of a derivative, which is the same in both modes (engine/derivatives.cpp).
#pragma once

#include <memory>
#include <vector>

#include "engine/call_scene.h"
#include "engine/decisions/decisions.h"
#include "engine/decisions/field_edges.h"
#include "engine/decisions/shading_rules.h"
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

    // Calls visit(std::vector<TermPass>) twice: with the first passes, which distribute the samples of later
    // ones, then with all other passes.
    template <typename Visit>
    void run(DerivativeMode mode, const Progress& pilot, std::vector<ThreadMemory>& memory,
             const Visit& visit) {
        visit(first_passes(mode));
        if (specular) specular->guide();
        thin_interior(guide_second_passes(boundaries), pilot, memory);
        distribute_interior(pilot, memory);
        visit(later_passes(mode));
    }
    std::vector<TermPass> first_passes(DerivativeMode mode) const;
    std::vector<TermPass> later_passes(DerivativeMode mode) const;
    // All terms that are not null, in the order of reports.
    std::vector<Term*> terms() const;
    int64_t chunks() const;

    // Adds the samples and seconds of each part to the decisions, after the last pass.
    void note_effort();
    // Writes the number of samples of each term.
    void count_samples(LearnedSampling& learned) const;
    // The samples that were left out because they are not finite, by term.
    Dropped all_dropped() const;
    // Called between the two passes of the boundary terms, with their variance. Reduces the number of samples
    // of the interior term if its variance is far lower (engine/interior_pilot.cpp).
    void thin_interior(double boundary_variance, const Progress& progress,
                       std::vector<ThreadMemory>& of_thread);
    // Called after that. Gives the pixels in which the interior term has more variance more of its samples.
    void distribute_interior(const Progress& progress, std::vector<ThreadMemory>& of_thread);
    // Divides the number of samples of the interior term.
    void divide_interior(int by);
    // Whether only positions of vertices and of the camera are requested.
    bool requests_motion_alone() const;
    bool may_thin_interior() const;
    bool may_distribute_interior() const;
    // The tables with tangents along a motion, which are zero before.
    DifferentiableTables along_motion(TableValues& motion) const;
    // Adds the estimated variances of the means of the pilot's pixels, all channels, in one of its chunks,
    // and the part of their samples that has a derivative (null: not counted).
    void add_variance(const ImagePlan& pilot, const DifferentiableTables& along, int64_t chunk,
                      ThreadMemory& memory, double* by_pixel, double* touched) const;
    double interior_variance(const Progress& progress, std::vector<ThreadMemory>& of_thread) const;
    ImagePlan interior_plan(const RenderOptions& options) const;
    // Gives pixels on outlines of moving fields more samples: hits that graze a field have large derivatives.
    void add_samples_on_outlines(uint32_t seed);
    // Derivatives by strengths and colours reuse the picture's random numbers, and so do derivatives that are
    // requested with them.
    bool reuses_picture() const;
    // Whether any material has lobes that are worth pairs of mirrored samples.
    bool any_sharp_material() const;
    // Decides on the interior term and its rims. `own`: the options with their number of samples.
    void begin_interior(const RenderOptions& options, const RenderOptions& own);
    // Lists the meshes and materials that paths must meet to be recorded.
    void list_requested_surfaces(Decision& shading) const;
    // Adds samples by area of faces that are seen edge-on.
    void sample_edge_on_faces();
    // The tangents or gradients of boundary terms; null where they are not requested.
    DerivativeView boundary_view(const GradientGroups::View& v) const {
        const auto first = static_cast<int32_t>(requested.span(FloatTable::kVertices).first / 3);
        return {v.vertices,       first,         v.camera,        v.instances,
                v.lights,         v.rotation,    v.tables.fields, motion.own_camera,
                motion.instances, motion.lights, motion.rotation, motion.warped};
    }

    const Engine& engine;
    const Requested& requested;
    const std::vector<int8_t> sides;
    Decisions decided;
    PartClock clock;
    const FieldEdges field_edges;
    const RequestedMotion motion;
    const bool chains;    // whether edges move, or rays bend on their way (moves_chains)
    const bool geometry;  // whether positions, directions or normals of a path's vertices change
    const std::shared_ptr<const LightList> lights;
    const PreparedScene prepared;
    const SceneView& scene;
    const std::vector<NamedTable> tables;
    const PathRecording recording;
    ShadingRules shading;
    const bool rims_turn;  // whether rims of lobes may move in the interior term
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
