// What a derivative's call consists of, part by part: what is computed, what is zero, and why. The engine
// asks here whether to compute a part, and returns the same answers as data (core/planning puts them into
// words).
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
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
    kNeeded,            // it may not be zero
    kForced,            // it is zero, but computed to see that (RenderOptions::force)
    kNotRendered,       // paths are too short for it
    kStill,             // nothing moves that could change it
    kBlack,             // all surfaces are black
    kAlone,             // one convex body, which hides no light from itself
    kNothingBetween,    // at most two convex bodies: nothing is between any two surfaces
    kFlat,              // all edges are between two faces of one plane
    kNone,              // the scene has nothing of the kind
    kNoLight,           // no light that it is about
    kPointlike,         // all lights are without size
    kOutOfView,         // the camera sees none
    kUnseen,            // camera rays don't meet it
    kLooksTheSame,      // a flat convex body under an even environment
    kOnlyOutlineMoves,  // emissive meshes whose light keeps its direction
    kUnshaded,          // what moves is black
    kRaysDiffer,        // some kinds of scattered rays meet a mesh and others don't
    kNotEstimated,      // no part of the estimators covers it
    kReasons
};
extern const char* const kReasonNames[static_cast<size_t>(Reason::kReasons)];

struct Decision {
    Outcome outcome = Outcome::kZero;
    Reason reason = Reason::kNone;
    EdgeCounts edges;
    std::vector<int32_t> meshes, lights, materials;
    std::vector<std::array<int32_t, 2>> pairs;    // of meshes
    std::vector<std::array<int32_t, 2>> pierced;  // a light's row, and the mesh that passes through it
    int64_t limit = 0;  // the number (of faces, of surfaces) above which the part is missing; 0: it has none
    double samples = 0.0, seconds = 0.0;  // of a call: taken, and spent by all threads
};

class Decisions {
 public:
    // `alone`: nothing is computed, so that no samples need to be prepared.
    explicit Decisions(uint64_t force = 0, bool alone = false) : force_(force), alone_(alone) {}
    bool alone() const { return alone_; }

    // Decides on a part: computed, unless there is a reason for which it is zero. Returns whether it is.
    bool decide(Part part, Reason reason) {
        Decision& d = entry(part).emplace();
        const bool needed = reason == Reason::kNeeded;
        const bool missing = reason == Reason::kRaysDiffer || reason == Reason::kNotEstimated;
        const bool forced = !needed && !missing && (force_ >> static_cast<int>(part) & 1) != 0;
        d.reason = forced ? Reason::kForced : reason;
        d.outcome = needed || forced ? Outcome::kComputed : missing ? Outcome::kMissing : Outcome::kZero;
        return needed || forced;
    }
    bool computes(Part part) const { return at(part) && at(part)->outcome == Outcome::kComputed; }
    bool forces(Part part) const { return at(part) && at(part)->reason == Reason::kForced; }
    // Nothing of the kind was found.
    void none(Part part, Reason reason) {
        entry(part)->outcome = Outcome::kZero;
        entry(part)->reason = reason;
    }
    // Intersections that a search has found: their meshes and lights. Returns whether there are any.
    bool found(Part part, const SceneTables& tables, const Intersections& lines);
    // The materials that a part is about; it is zero if there are none. Returns whether there are any.
    bool lists_materials(Part part, std::vector<int32_t> materials);
    Decision& operator[](Part part) { return *entry(part); }
    const std::optional<Decision>& at(Part part) const { return parts_[static_cast<size_t>(part)]; }

 private:
    std::optional<Decision>& entry(Part part) { return parts_[static_cast<size_t>(part)]; }

    uint64_t force_;
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

// Rows of spots whose light ends at once.
std::vector<int32_t> hard_cones(const SceneTables::LightRows& lights);

// The materials of visible faces of which a closure is such.
template <typename Is>
std::vector<int32_t> used_materials(const SceneTables& tables, const Is& is) {
    std::vector<int32_t> out;
    for (size_t m = 0; m < tables.material_used.size(); ++m) {
        if (!tables.material_used[m]) continue;
        for (int32_t k = tables.material_first_closure[m]; k < tables.material_first_closure[m + 1]; ++k)
            if (is(static_cast<size_t>(k))) {
                out.push_back(static_cast<int32_t>(m));
                break;
            }
    }
    return out;
}

// The visible meshes that some, but not all, of the kinds of rays in a mask meet.
std::vector<int32_t> partly_met_meshes(const SceneTables& tables, int32_t rays);

// Whether what is requested turns or shifts the camera's rays: a pinhole has no focus, a round aperture
// doesn't turn.
bool moves_rays(const CameraView& camera, const Requested& requested);

// What decisions on boundary terms are made from.
struct BoundaryFacts {
    const SceneView& scene;
    const SceneTables& tables;
    const RenderOptions& options;
    const RequestedMotion& motion;
    bool chains;           // edges move, or rays bend on their way (moves_chains)
    bool nothing_between;  // any two surfaces (Engine::hides_no_surface)
};
// Decides on the parts of the boundary terms before candidates are looked for, where there may be none.
void decide_boundaries(const BoundaryFacts& facts, Decisions& decided);

}  // namespace edgegrad
