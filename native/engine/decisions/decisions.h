// The decisions on a derivative: for each part, whether it is computed, zero or missing, and the reason. The
// engine computes parts by these decisions, and returns them as data, which core/planning puts into words.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <type_traits>
#include <vector>

#include "boundary/curves/edge_counts.h"
#include "boundary/curves/intersections.h"
#include "engine/derivative_tables.h"
#include "engine/engine.h"
#include "scene/view.h"
#include "tasks/derivative_part.h"

namespace edgegrad {

enum class Outcome : int32_t { kComputed, kZero, kMissing };

enum class Reason : int32_t {
    kNeeded,            // the part may not be zero
    kForced,            // zero, but computed for a test (RenderOptions::force)
    kNotRendered,       // paths are too short
    kStill,             // nothing that it depends on moves
    kBlack,             // all surfaces are black
    kAlone,             // one convex body, which occludes no light from itself
    kNothingBetween,    // at most two convex bodies: nothing is between any two surfaces
    kFlat,              // all edges are between two faces of one plane
    kNone,              // the scene has no such objects
    kNoLight,           // no such light
    kPointlike,         // all lights are without size
    kOutOfView,         // the camera sees no such edge
    kUnseen,            // camera rays cannot hit the mesh
    kLooksTheSame,      // a flat convex body under an even environment
    kOnlyOutlineMoves,  // emissive meshes whose light has a fixed direction
    kUnshaded,          // meshes that scatter no light, and emit none that others scatter
    kRaysDiffer,        // some kinds of scattered rays can hit a mesh and others cannot
    kNotEstimated,      // no estimator exists
    kOutlinesServe,     // another estimator takes its place
    kUnread,            // no table depends on the parameter
    kUnused,            // no visible face has the material, or a material that reads the texture
    kReasons
};
extern const char* const kReasonNames[static_cast<size_t>(Reason::kReasons)];

// How one requested parameter changes the picture.
struct ParameterEffect {
    Reason shading = Reason::kNeeded;  // why it changes no shading; kNeeded: it may
    bool picture_stays = false;        // neither shading nor an edge that it moves changes the picture
};

struct Decision {
    Outcome outcome = Outcome::kZero;
    Reason reason = Reason::kNone;
    EdgeCounts edges;
    std::vector<int32_t> meshes, lights, materials;
    std::vector<std::array<int32_t, 2>> pairs;    // of meshes
    std::vector<std::array<int32_t, 2>> pierced;  // a light's row, and the mesh that passes through it
    int64_t limit = 0;  // the number (of faces, of surfaces) above which the part is missing; 0: it has none
    double samples = 0.0, seconds = 0.0;        // of a call; seconds of all threads together
    std::vector<ParameterEffect> by_parameter;  // of Part::kInterior, from Engine::decide
};

struct BoundaryFacts;

class Decisions {
 public:
    // `alone`: nothing is computed after the decisions, so no samples are prepared.
    explicit Decisions(PartSet force = {}, bool alone = false) : force_(force), alone_(alone) {}
    bool alone() const { return alone_; }

    // Decides on a part: it is computed for the reason kNeeded, missing for some reasons, and zero for all
    // others. Returns whether it is computed.
    bool decide(Part part, Reason reason) {
        Decision& d = entry(part).emplace();
        const bool needed = reason == Reason::kNeeded;
        const bool missing = reason == Reason::kRaysDiffer || reason == Reason::kNotEstimated;
        const bool forced = !needed && !missing && force_[static_cast<size_t>(part)];
        d.reason = forced ? Reason::kForced : reason;
        d.outcome = needed || forced ? Outcome::kComputed : missing ? Outcome::kMissing : Outcome::kZero;
        return needed || forced;
    }
    bool computes(Part part) const { return at(part) && at(part)->outcome == Outcome::kComputed; }
    // Whether some part of a boundary term is computed, or missing.
    bool any_boundary() const {
        for (size_t k = 0; k < kPartCount; ++k)
            if (parts_[k] && parts_[k]->outcome != Outcome::kZero && kPartTable[k].term != kInteriorTerm)
                return true;
        return false;
    }
    bool forces(Part part) const { return at(part) && at(part)->reason == Reason::kForced; }
    // Changes a part to zero, after a search without a result.
    void none(Part part, Reason reason) {
        (*this)[part].outcome = Outcome::kZero;
        (*this)[part].reason = reason;
    }
    // Notes the meshes and lights of intersections that a search has found. Returns whether there are any.
    bool found(Part part, const SceneTables& tables, const Intersections& lines);
    // Names the meshes whose faces coincide, of which one or the camera moves: rounding decides what is seen.
    void found_coincident(const SceneTables& tables, const Intersections& lines,
                          const RequestedMotion& motion);
    // Names the meshes that touch along edges or faces, of which one moves and the other does not.
    void found_parting(const BoundaryFacts& facts, const Requested& requested, int threads);
    // The decision on a part without an estimator, which may have been found already.
    Decision& missing(Part part) {
        if (!at(part) || at(part)->outcome != Outcome::kMissing) decide(part, Reason::kNotEstimated);
        return (*this)[part];
    }
    // Notes the materials of a part, which is zero if there are none. Returns whether it is computed.
    bool lists_materials(Part part, std::vector<int32_t> materials);
    // The decision on a part that is requested.
    Decision& operator[](Part part) { return entry(part).value(); }
    const std::optional<Decision>& at(Part part) const { return parts_[static_cast<size_t>(part)]; }

 private:
    std::optional<Decision>& entry(Part part) { return parts_[static_cast<size_t>(part)]; }

    PartSet force_;
    bool alone_;
    std::array<std::optional<Decision>, kPartCount> parts_;  // none: not requested
};

// Seconds by part, of all threads together.
class PartClock {
 public:
    class Running {
     public:
        explicit Running(std::atomic<int64_t>& total);
        ~Running();
        Running(const Running&) = delete;
        Running& operator=(const Running&) = delete;

     private:
        std::atomic<int64_t>& total_;
        int64_t start_;
    };
    Running run(Part part) { return Running(spent_[static_cast<size_t>(part)]); }
    double seconds(Part part) const { return 1e-9 * static_cast<double>(spent_[static_cast<size_t>(part)]); }

 private:
    std::array<std::atomic<int64_t>, kPartCount> spent_{};
};

// Rows of spots without blend.
std::vector<int32_t> hard_cones(const SceneTables::LightRows& lights);

// The materials of visible faces with a closure for which `is` holds: is(closure) or is(closure, material).
template <typename Is>
std::vector<int32_t> used_materials(const SceneTables& tables, const Is& is) {
    std::vector<int32_t> out;
    for (size_t m = 0; m < tables.material_used.size(); ++m) {
        const auto holds = [&](size_t k) {
            if constexpr (std::is_invocable_v<Is, size_t, size_t>)
                return is(k, m);
            else
                return is(k);
        };
        if (tables.material_used[m] && any_closure(tables, m, holds)) out.push_back(static_cast<int32_t>(m));
    }
    return out;
}

// The same by material: 1 or 0.
template <typename Is>
std::vector<uint8_t> marked_materials(const SceneTables& tables, const Is& is) {
    std::vector<uint8_t> out(tables.material_used.size(), 0);
    for (const int32_t m : used_materials(tables, is)) out[static_cast<size_t>(m)] = 1;
    return out;
}

// Whether a mesh has a face of a marked material.
inline bool has_face_of(const SceneTables& tables, size_t mesh, const std::vector<uint8_t>& marked) {
    const int32_t* faces = tables.face_material.data();
    return std::any_of(faces + tables.mesh_first_face[mesh], faces + tables.mesh_first_face[mesh + 1],
                       [&](int32_t m) { return marked[static_cast<size_t>(m)] != 0; });
}

// The visible meshes that some, but not all, of the kinds of rays in a mask can hit.
std::vector<int32_t> partly_met_meshes(const SceneTables& tables, int32_t rays);

// Materials that may have camera-sampled lobes (boundary/segment/camera_sampled_lobes.h): the limits of alpha
// are those of lobes that reflect and that transmit. `perfect`: paths may have both perfect and other lobes
// before the segment.
std::vector<int32_t> camera_sampled_materials(const SceneView& scene, const SceneTables& tables,
                                              float reflected, float transmitted, bool perfect);

// The emissive meshes whose shadows are sampled from the camera, too
// (boundary/terms/camera_sampled_shadow.h). There are none if scattered rays differ in the meshes that they
// meet, or if emissive surfaces are transparent: then both kinds of samples would not find the same light.
std::vector<int32_t> camera_sampled_emitters(const SceneView& scene, const SceneTables& tables);

// The lights without size that rays of some of the kinds `seen_by` find.
std::vector<int32_t> lights_without_size(const SceneTables& tables, int32_t seen_by);

// Lights and emissive meshes whose shadows are left out on surfaces that paths reach by both perfect and
// other lobes: samples that start at the camera do not find them, or may not share them with samples from
// edges.
struct FurtherShadows {
    std::vector<int32_t> lights, meshes;
};
FurtherShadows missing_further_shadows(const SceneView& scene, const SceneTables& tables);

// The least depth with shadows on surfaces that paths reach by both a perfect and another lobe. Light that a
// surface scatters needs one segment more.
constexpr int kShadowSegments = 4;

// Whether the requested parameters turn or shift the camera's rays. The focus of a pinhole and the rotation
// of a round aperture do not.
bool moves_rays(const CameraView& camera, const FloatSpans& requested);

// The facts from which boundary terms are decided.
struct BoundaryFacts {
    const SceneView& scene;
    const SceneTables& tables;
    const RenderOptions& options;
    const RequestedMotion& motion;
    bool chains;           // edges move, or directions of rays change (moves_chains)
    bool bends;            // directions of rays change by values or normals (bends_chains)
    bool rims_turn;        // the interior term is requested, and rims of lobes may move
    bool nothing_between;  // no surface is between two others (Engine::hides_no_surface)
    EdgeCache& kept;
};
// Decides on the parts of the boundary terms, before the search for candidate edges, which may find none.
void decide_boundaries(const BoundaryFacts& facts, Decisions& decided);

}  // namespace edgegrad
