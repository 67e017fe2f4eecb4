#include "engine/decisions/missing/missing_search.h"

#include <utility>

#include "boundary/curves/light_intersections.h"
#include "boundary/meshes/normals_below.h"
#include "engine/decisions/interior_rules.h"
#include "engine/decisions/mirrored_edges.h"
#include "engine/decisions/value_sources.h"
#include "scene/lights/light_params.h"

namespace edgegrad {
namespace {

// Whether shading normals may turn, or the normals of faces.
bool normals_turn(const MissingSearch& s) {
    return s.requested.any(FloatTable::kNormals) || s.requested.textures() ||
           (s.requested.span(FloatTable::kClosures).columns &
            Requested::columns(kNormalMap, kNormalStrength + 1)) != 0;
}

// For lights without size, rims of lobes are lines on the surface.
void rim_lines(const MissingSearch& s) {
    constexpr int32_t kSeen = 1 << kTransmissionRay | 1 << kDiffuseRay | 1 << kGlossyRay;
    std::vector<int32_t> found = lights_without_size(s.tables, kSeen);
    if (found.empty() || !s.facts.rims_turn) return;
    s.lights(Part::kRimLines, std::move(found));
    s.decided[Part::kRimLines].materials = used_materials(
        s.tables, [&](size_t k) { return may_have_rim(s.tables, k, s.facts.scene.least_alpha > 0.0f); });
}

}  // namespace

void miss_mirrored_parts(const MissingSearch& s) {
    if (s.facts.options.max_depth < 2) return;
    if (s.any_moves || normals_turn(s)) {
        const auto below = s.kept.normals_below.get(true, [&] { return normals_below(s.tables, s.threads); });
        s.materials(Part::kTurnedNormals, used_materials(s.tables, [&](size_t k, size_t m) {
                        return may_end_at_its_normal(s.tables, k, (*below)[m] != 0);
                    }));
    }
    const std::vector<int32_t> smooth =
        used_materials(s.tables, [&](size_t k) { return may_be_specular(s.tables, k); });
    rim_lines(s);
    if (smooth.empty()) return;
    if (s.chains_turn)
        s.materials(Part::kTotalReflection, used_materials(s.tables, [&](size_t k) {
                        return s.tables.closure_kind[k] == kRefraction && may_be_specular(s.tables, k);
                    }));
    if (s.facts.chains && s.facts.options.max_depth > kMostChain)
        s.materials(Part::kLongChains, smooth, kMostChain);
    s.pierced(Part::kMirroredLines, [&](size_t row, size_t mesh) {
        return is_sized(s.tables.lights.kind[row]) &&
               (s.chains_turn || s.moving[mesh] || s.light_moves(static_cast<int32_t>(row))) &&
               (s.tables.lights.visible_to[row] & s.tables.mesh_mask[mesh] & kBentRays) != 0;
    });
    const auto& caustics = s.decided.at(Part::kCausticEdges);
    const bool none = caustics && caustics->reason == Reason::kUnshaded;
    if (s.facts.options.max_depth > 2 && (s.any_moves || s.facts.chains) && !none)
        s.materials(Part::kCaustics, smooth);
    if ((s.any_moves || s.facts.chains) && s.facts.options.terms[kShadowTerm] &&
        s.facts.options.max_depth >= kShadowSegments) {
        FurtherShadows left = missing_further_shadows(s.facts.scene, s.tables);
        if (!left.lights.empty() || !left.meshes.empty()) s.materials(Part::kFurtherShadows, smooth);
        s.lights(Part::kFurtherShadows, std::move(left.lights));
        s.meshes(Part::kFurtherShadows, std::move(left.meshes));
    }
}

}  // namespace edgegrad
