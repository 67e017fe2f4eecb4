#include "engine/decisions/mirrored_edges.h"

#include <algorithm>

#include "engine/decisions/first_reason.h"
#include "engine/decisions/interior_rules.h"
#include "scene/mesh_instances.h"
#include "scene/sharp_lobes.h"

namespace edgegrad {
namespace {

// The sized lights of the table that mirrors, smooth glass and followed lobes show.
std::vector<int32_t> lights_in_mirrors(const BoundaryFacts& f) {
    const LightView& lights = f.scene.lights;
    std::vector<int32_t> shown;
    for (int32_t k = 0; k < lights.all_sized(); ++k) {
        const int32_t row = lights.sized[k];
        if ((lights.visible_to[row] & kBentRays) &&
            may_be_specular(f.tables, f.scene.light_followed ? f.scene.light_followed[row] : 0.0f))
            shown.push_back(row);
    }
    std::sort(shown.begin(), shown.end());
    return shown;
}

// Whether no surface scatters light but by perfect lobes.
bool all_perfect(const SceneView& scene, const SceneTables& tables) {
    const auto imperfect = [&](size_t closure) {
        const int32_t kind = tables.closure_kind[closure];
        const float roughness = tables.closure_params[kMaterialParams * closure + kRoughness];
        return (kind != kGlossy && kind != kGlass && kind != kRefraction) || roughness != 0.0f ||
               is_textured(tables, closure, kRoughness);
    };
    const std::vector<int32_t> found = used_materials(tables, imperfect);
    return std::all_of(found.begin(), found.end(), [&](int32_t m) { return is_black(scene, m); });
}

}  // namespace

std::vector<uint8_t> throwing_materials(const SceneTables& tables, float thrown) {
    return marked_materials(tables, [&](size_t k) { return may_throw_light(tables, k, thrown); });
}

bool too_many_throw(const SceneTables& tables, float thrown) {
    const std::vector<uint8_t> throwing = throwing_materials(tables, thrown);
    const auto instances = mesh_instances(tables);
    int64_t sum = 0;
    for (size_t m = 0; m < static_cast<size_t>(tables.first_field()); ++m)
        if (has_face_of(tables, m, throwing))
            sum += (tables.mesh_first_face[m + 1] - tables.mesh_first_face[m]) *
                   static_cast<int64_t>(instances[m].size());
    return sum > kMostMirrorFaces;
}

bool mirrors_turn(const BoundaryFacts& f) {
    const SceneTables& tables = f.tables;
    if (f.options.max_depth < 2) return false;
    if (f.motion.camera || f.bends) return true;
    const auto specular = marked_materials(
        tables, [&](size_t k) { return may_be_specular(tables, k, f.scene.followed_alpha); });
    const std::vector<uint8_t> moving = moving_surfaces(tables, f.motion);
    for (size_t mesh = 0; mesh < static_cast<size_t>(tables.visible_meshes); ++mesh)
        if (moving[mesh] && has_face_of(tables, mesh, specular)) return true;
    return false;
}

// Outlines of lights and edges in light that mirrors, smooth glass and narrow lobes throw on other surfaces.
void decide_caustics(const BoundaryFacts& f, const std::vector<int32_t>& partly_met, Decisions& decided) {
    if (!f.options.terms[kIndirectTerm]) return;
    const SceneView& scene = f.scene;
    std::vector<int32_t> smooth = used_materials(
        f.tables, [&](size_t closure) { return may_throw_light(f.tables, closure, scene.thrown_alpha); });
    const bool listed = smooth.empty() || !too_many_throw(f.tables, scene.thrown_alpha);
    const auto decide = [&](Part part, Reason light, bool moves) {
        const bool needed = decided.decide(
            part, first_of({unless(f.options.max_depth >= 3, Reason::kNotRendered),
                            unless(!smooth.empty(), Reason::kNone),
                            unless(!all_perfect(scene, f.tables), Reason::kUnshaded),
                            unless(!scene.convex, Reason::kAlone), light, unless(moves, Reason::kStill),
                            unless(partly_met.empty(), Reason::kRaysDiffer),
                            unless(listed, Reason::kNotEstimated)}));
        if (decided[part].reason == Reason::kNotEstimated) decided[part].limit = kMostMirrorFaces;
        if (needed) decided[part].materials = smooth;
        if (decided[part].reason == Reason::kRaysDiffer) decided[part].meshes = partly_met;
        return needed;
    };
    std::vector<int32_t> shown = lights_in_mirrors(f);
    const bool lit = scene.lights.count > 0 || scene.has_environment;
    if (decide(Part::kCausticOutlines, unless(!shown.empty(), Reason::kNoLight),
               f.chains || f.motion.camera || f.motion.lights))
        decided[Part::kCausticOutlines].lights = std::move(shown);
    decide(Part::kCausticEdges, unless(lit, Reason::kNoLight), f.chains || f.motion.camera);
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
