#include "engine/decisions/missing/missing_search.h"

#include <utility>

#include "boundary/fields/field_curves.h"
#include "boundary/fields/field_lights.h"
#include "scene/lights/light_params.h"
#include "scene/sharp_lobes.h"
#include "sdf/carrier/carrier.h"

namespace edgegrad {
namespace {

// Lights that fields pass through, where the curve moves over the light or in the picture.
void lights_in_fields(const MissingSearch& s) {
    auto found = fields_through_lights(s.tables, s.kept, s.threads, [&](size_t row, size_t mesh) {
        const auto light = static_cast<int32_t>(row);
        const int32_t seen = s.tables.lights.visible_to[row] & s.tables.mesh_mask[mesh];
        // The part of these lights that a point sees turns with the point
        const int32_t kind = s.tables.lights.kind[row];
        const bool turns = kind == kSphereLight || kind == kDiskLight;
        return s.surface_moves[mesh] || s.light_moves(light) ||
               (s.motion.camera && (turns || (seen & (1 << kCameraRay)))) ||
               (turns && (s.motion.any_mesh_moves() || s.motion.any_field_moves())) ||
               (s.chains_turn && (seen & kBentRays));
    });
    if (!found.empty()) s.miss(Part::kFieldLines).pierced = std::move(found);
}

// What fields hide of the light of narrow lobes that are not followed, which few samples find.
void narrow_lobes(const MissingSearch& s) {
    // Alpha; in wider lobes more of them do. Light passes two lobes of a body of rough glass.
    constexpr float kFound = 0.05f, kFoundThrough = 0.5f;
    if (s.facts.options.max_depth < 2) return;
    s.materials(Part::kNarrowFieldLobes, used_materials(s.tables, [&](size_t k) {
                    const bool through = s.tables.closure_flags[k] & kHasRefraction;
                    return has_sharp_lobe(s.tables, k, through ? kFoundThrough : kFound) &&
                           !may_be_specular(s.tables, k, s.facts.scene.followed_alpha);
                }));
}

}  // namespace

void miss_field_parts(const MissingSearch& s) {
    if (s.tables.fields.empty() || !s.any_moves) return;
    const auto carriers = field_carriers(s.tables, s.kept, s.threads);
    std::vector<int32_t> ended, thin;
    for (int32_t mesh = s.tables.first_field(); mesh < s.tables.visible_meshes; ++mesh) {
        const auto k = static_cast<size_t>(mesh - s.tables.first_field());
        if (may_end_at_its_box(s.tables.fields[k].view())) ended.push_back(mesh);
        if (!(*carriers)[k].complete) thin.push_back(mesh);
    }
    if (s.motion.camera || s.motion.any_mesh_moves() || s.motion.any_field_moves())
        s.meshes(Part::kFieldBorders, std::move(ended));
    s.meshes(Part::kThinFields, std::move(thin));
    lights_in_fields(s);
    narrow_lobes(s);
}

}  // namespace edgegrad
