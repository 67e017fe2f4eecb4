#include "engine/decisions/missing/missing_search.h"

#include <algorithm>
#include <utility>

#include "boundary/curves/light_intersections.h"
#include "engine/decisions/interior_rules.h"
#include "engine/decisions/value_sources.h"
#include "scene/closure_programs.h"
#include "scene/lights/light_params.h"
#include "scene/textures/jumps.h"
#include "tasks/scan_task.h"

namespace edgegrad {
namespace {

// The ways between transparent surfaces are constants in sweeps.
void absorbing_surfaces(const MissingSearch& s) {
    s.materials(Part::kClearAbsorption, used_materials(s.tables, [&](size_t k) {
                    const size_t values = kMaterialParams * k + kAbsorption;
                    const int32_t flags = s.tables.closure_flags[k];
                    return (flags & kHasAbsorption) && (flags & kHasTransparency) &&
                           (s.any_moves || s.requested.any(FloatTable::kClosures, values, values + 3));
                }));
}

// Scattering events in media stand still, and media have no boundary terms of their own.
void media(const MissingSearch& s) {
    if (!s.facts.scene.any_medium || !s.motion.any()) return;
    Decision& part = s.miss(Part::kMedia);
    for (size_t m = 0; m < s.tables.material_used.size(); ++m)
        if (has_medium(s.tables, m)) part.materials.push_back(static_cast<int32_t>(m));
}

// Light of the table jumps on a surface that passes through its source, and where its source lies in a
// surface, which hides it or not.
void light_jumps(const MissingSearch& s) {
    if (s.facts.scene.lights.sized_count == 0) return;
    auto on_faces = lights_on_faces(
        s.tables,
        [&](size_t row, size_t mesh) { return s.moving[mesh] || s.light_moves(static_cast<int32_t>(row)); },
        s.threads);
    if (!on_faces.empty()) s.miss(Part::kCoincidentFaces).pierced = std::move(on_faces);
    std::vector<uint8_t> lit(static_cast<size_t>(s.tables.visible_meshes), 0);
    for (size_t m = 0; m < lit.size(); ++m)
        for (int32_t f = s.tables.mesh_first_face[m]; f < s.tables.mesh_first_face[m + 1] && !lit[m]; ++f)
            lit[m] = !is_black(s.facts.scene, s.facts.scene.face_material[f]);
    s.pierced(Part::kLightJumps, [&](size_t row, size_t mesh) {
        return s.tables.lights.kind[row] != kDiskLight && lit[mesh] &&
               (s.motion.camera || s.motion.lights || s.moving[mesh]);
    });
}

// A light without size reaches all of a face or none of it. As it passes the plane of a face that is
// shaded with other normals than its own, the face's radiance jumps at a single value of the parameters,
// of which no derivative at other values has a part. Meshes with a terminator offset are lit from below
// the planes of their faces, too: there the edges of shadows, also of their own, are not sampled.
void face_flips(const MissingSearch& s) {
    std::vector<int32_t> smooth, lifted;
    if (!s.decided.at(Part::kHorizons)) return;  // the shadow term is not requested
    for (const int32_t mesh : s.decided[Part::kHorizons].meshes) {
        const bool below =
            s.facts.scene.any_terminator && s.tables.mesh_terminator[static_cast<size_t>(mesh)] > 0;
        (below ? lifted : smooth).push_back(mesh);
    }
    if (s.facts.scene.lights.count > 0 || s.facts.scene.environment_image.sampled)
        s.meshes(Part::kLitFromBelow, std::move(lifted));
    const bool any_moves = std::any_of(
        smooth.begin(), smooth.end(), [&](int32_t mesh) { return s.moving[static_cast<size_t>(mesh)] != 0; });
    std::vector<int32_t> found;
    for (size_t row = 0; !smooth.empty() && row < s.tables.lights.kind.size(); ++row) {
        const auto light = static_cast<int32_t>(row);
        if (!is_sized(s.tables.lights.kind[row]) && (any_moves || s.light_moves(light)))
            found.push_back(light);
    }
    if (found.empty()) return;
    s.lights(Part::kFaceFlips, std::move(found));
    s.decided[Part::kFaceFlips].meshes = smooth;
}

void lit_surfaces(const MissingSearch& s) {
    if (s.facts.options.max_depth < 2 || all_black(s.facts.scene, s.tables)) return;
    const LightView& lights = s.facts.scene.lights;
    const bool sized = lights.face_light || lights.all_sized() > 0;
    if ((sized || s.facts.scene.has_environment) && (s.any_moves || changes_densities(s.requested)))
        s.meshes(Part::kPartlySeenShadows, partly_met_meshes(s.tables, kScatteredRays | 1 << kShadowRay));
    if (!s.any_moves) return;
    light_jumps(s);
    face_flips(s);
    s.materials(Part::kSteppedShadows, used_materials(s.tables, [&](size_t k) {
                    return (s.tables.closure_flags[k] & kHasTransparency) && texture_jumps(s.tables, k).any();
                }));
}

}  // namespace

void miss_lit_parts(const MissingSearch& s) {
    lit_surfaces(s);
    absorbing_surfaces(s);
    media(s);
}

}  // namespace edgegrad
