#include "engine/decisions/mirrored_edges.h"

#include <algorithm>

#include "engine/decisions/first_reason.h"
#include "scene/mesh_instances.h"
#include "scene/sharp_lobes.h"

namespace edgegrad {
namespace {

// The largest alpha of lobes by their width (shading/bsdf/followed_lobes.h).
constexpr float kMostAlphaByWidth = 5.0f;

// The sized lights of the table that mirrors, smooth glass and followed lobes show.
std::vector<int32_t> lights_in_mirrors(const BoundaryFacts& f) {
    const LightView& lights = f.scene.lights;
    std::vector<int32_t> shown;
    for (int32_t k = 0; k < lights.sized_count + lights.sized_distant; ++k) {
        const int32_t row = lights.sized[k];
        if ((lights.visible_to[row] & kBentRays) &&
            may_be_specular(f.tables,
                            f.scene.light_followed ? kMostAlphaByWidth * f.scene.light_followed[row] : 0.0f))
            shown.push_back(row);
    }
    std::sort(shown.begin(), shown.end());
    return shown;
}

}  // namespace

bool mirrors_turn(const BoundaryFacts& f) {
    const SceneTables& tables = f.tables;
    if (f.options.max_depth < 2) return false;
    if (f.motion.camera || f.bends) return true;
    std::vector<uint8_t> specular(tables.material_used.size(), 0);
    for (const int32_t m :
         used_materials(tables, [&](size_t k) { return may_be_specular(tables, k, f.scene.followed_alpha); }))
        specular[static_cast<size_t>(m)] = 1;
    const std::vector<uint8_t> moving = moving_surfaces(tables, f.motion);
    for (size_t mesh = 0; mesh < static_cast<size_t>(tables.visible_meshes); ++mesh) {
        const auto* first = tables.face_material.data() + tables.mesh_first_face[mesh];
        const auto* last = tables.face_material.data() + tables.mesh_first_face[mesh + 1];
        if (moving[mesh] &&
            std::any_of(first, last, [&](int32_t m) { return specular[static_cast<size_t>(m)] != 0; }))
            return true;
    }
    return false;
}

void decide_mirrored(const BoundaryFacts& f, const std::vector<int32_t>& partly_met, Decisions& decided) {
    const SceneView& scene = f.scene;
    const RenderOptions& options = f.options;
    const Reason mirror = unless(may_be_specular(f.tables, scene.followed_alpha), Reason::kNone);
    const std::vector<int32_t> smooth =
        used_materials(f.tables, [&](size_t closure) { return may_be_specular(f.tables, closure); });
    std::vector<int32_t> followed = used_materials(f.tables, [&](size_t closure) {
        return may_be_specular(f.tables, closure, scene.followed_alpha) &&
               !may_be_specular(f.tables, closure);
    });
    const auto decide = [&](Part part, int depth, Reason light, bool moves) {
        const bool needed =
            decided.decide(part, first_of({mirror, unless(options.max_depth >= depth, Reason::kNotRendered),
                                           light, unless(moves, Reason::kStill)}));
        if (needed) decided[part].materials = smooth;
    };
    const bool lit = scene.lights.count > 0 || scene.has_environment;
    if (options.terms[kPrimaryTerm] || options.terms[kShadowTerm] || options.terms[kIndirectTerm]) {
        decided.decide(Part::kFollowedLobes, unless(!followed.empty(), Reason::kNone));
        decided[Part::kFollowedLobes].materials = std::move(followed);
    }
    if (options.terms[kPrimaryTerm]) {
        decide(Part::kMirroredEdges, 2, Reason::kNeeded, f.chains);
        std::vector<int32_t> shown = lights_in_mirrors(f);
        decide(Part::kMirroredOutlines, 2, unless(!shown.empty(), Reason::kNoLight),
               f.motion.lights || mirrors_turn(f));
        if (decided.computes(Part::kMirroredOutlines))
            decided[Part::kMirroredOutlines].lights = std::move(shown);
    }
    // Such a shadow needs three segments: from the camera to the mirror, to the receiver, and to the light.
    if (options.terms[kShadowTerm])
        decide(Part::kMirroredShadows, 3,
               first_of({unless(lit, Reason::kNoLight), unless(!scene.convex, Reason::kAlone)}),
               f.chains || f.motion.lights || f.motion.rotation);
    // Light that another surface scatters to the receiver needs one more segment.
    if (options.terms[kIndirectTerm])
        decide(Part::kMirroredLight, 4,
               first_of({unless(!f.nothing_between, Reason::kNothingBetween),
                         unless(partly_met.empty(), Reason::kRaysDiffer)}),
               f.chains);
}

}  // namespace edgegrad
