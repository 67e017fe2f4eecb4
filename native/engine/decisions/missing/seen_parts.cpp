#include "engine/decisions/missing/missing_search.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "boundary/curves/texture_borders.h"
#include "boundary/meshes/star_shaped.h"
#include "boundary/meshes/trees/face_tree.h"
#include "engine/decisions/missing/clip_borders.h"
#include "engine/decisions/value_sources.h"
#include "scene/lights/light_params.h"
#include "scene/mesh_instances.h"
#include "scene/sharp_lobes.h"
#include "scene/textures/jumps.h"

namespace edgegrad {
namespace {

std::vector<int32_t> not_star_shaped(const MissingSearch& s, std::vector<int32_t> closed) {
    std::erase_if(
        closed, [&](int32_t mesh) { return is_star_shaped(s.tables, static_cast<size_t>(mesh), s.threads); });
    return closed;
}

// An edge's samples draw the point of the lens. If the blurred edge covers very many pictures, nearly all
// of them miss this one.
void wide_lens(const MissingSearch& s) {
    const CameraView& c = s.facts.scene.camera;
    if (c.kind != kPerspective || !(c.aperture_radius > 0.0f)) return;
    constexpr double kMostPictures = 30.0;
    const double blur = double{c.focal} * c.aperture_radius / c.focus_distance;
    const double picture = double(c.full_width) * c.full_height;
    if (s.any_moves && blur * blur > kMostPictures * picture) s.miss(Part::kWideLens);
}

// The picture is black beyond a fisheye's disc.
void disc_border(const MissingSearch& s) {
    const CameraView& c = s.facts.scene.camera;
    const auto any = [&](size_t first, size_t last) {
        return s.requested.any(FloatTable::kCamera, first, last);
    };
    if (!is_fisheye(c.kind) ||
        !(any(kCameraPixelAspect, kCameraPanorama) || any(kCameraDisc, kCameraDisc + 1)))
        return;
    const auto farthest = [](float place, int32_t size) {
        return std::max(std::abs(place), std::abs(static_cast<float>(size) - place));
    };
    const float reach =
        std::hypot(farthest(c.principal[0], c.width), farthest(c.principal[1], c.height) * c.pixel_aspect);
    if (c.disc < reach) s.miss(Part::kDiscBorder);
}

// Points have one place in an equirectangular picture, whose latitude is between the poles.
void beyond_poles(const MissingSearch& s) {
    const CameraView& c = s.facts.scene.camera;
    constexpr float kPole = 1.5707964f * (1.0f + 1e-5f);
    const float most = std::max(std::abs(c.panorama[2]), std::abs(c.panorama[3]));
    if (c.kind == kEquirectangular && s.any_moves && most > kPole) s.miss(Part::kBeyondPoles);
}

// Textures with jumps that move over static meshes. Pixels of images move those that depend on their
// values.
void slid_textures(const MissingSearch& s) {
    const bool moves = s.requested.any(FloatTable::kTextureAttributes) ||
                       s.requested.any(FloatTable::kTextureLookups) ||
                       s.requested.any(FloatTable::kTextureConstants);
    if (!moves && !s.requested.any(FloatTable::kTexturePixels)) return;
    const auto reads = [&](const TextureInstruction& step) {
        return reads_requested(s.facts.scene.textures, s.requested, step);
    };
    s.materials(Part::kSlidTextures, used_materials(s.tables, [&](size_t k) {
                    const TextureJumps jumps = texture_jumps(s.tables, k);
                    if (moves && jumps.any()) return true;
                    return (moves ? jumps.past_hues : jumps.by_images) && any_step(s.tables, k, reads);
                }));
}

// A flat face turns parallel rays into one direction, in which a sun is or is not. It appears on all of
// the face at once, at a single value of the parameters.
void suns_in_flat_mirrors(const MissingSearch& s) {
    bool any_sun = false, moves = s.motion.camera;
    for (const int32_t row : s.sized_lights(kBentRays)) {
        if (s.tables.lights.kind[static_cast<size_t>(row)] != kConeLight) continue;
        any_sun = true;
        moves = moves || s.light_moves(row);
    }
    if (!any_sun) return;
    const std::vector<uint8_t> smooth = throwing_materials(s.tables, 0.0f);
    std::vector<int32_t> flat;
    for (int32_t mesh = 0; mesh < s.tables.first_field(); ++mesh) {
        const auto m = static_cast<size_t>(mesh);
        const auto is_flat = [&](size_t face) {
            const auto material = static_cast<size_t>(s.tables.face_material[face]);
            return smooth[material] &&
                   (s.tables.corner_normal.empty() || s.tables.corner_normal[3 * face] < 0);
        };
        if (!moves && !s.moving[m]) continue;
        bool found = false;
        for (int32_t f = s.tables.mesh_first_face[m]; f < s.tables.mesh_first_face[m + 1] && !found; ++f)
            found = is_flat(static_cast<size_t>(f));
        if (found) flat.push_back(mesh);
    }
    s.meshes(Part::kParallelMirrors, std::move(flat));
}

// Lights whose outlines or intersections depend on the origin of parallel rays.
void lights_by_parallel_rays(const MissingSearch& s) {
    const CameraView& c = s.facts.scene.camera;
    if (c.kind != kOrthographic) return;
    const SceneTables::LightRows& rows = s.tables.lights;
    if (c.aperture_radius > 0.0f && (s.motion.camera || s.motion.lights)) {
        std::vector<int32_t> blurred = s.sized_lights(1 << kCameraRay);
        std::erase_if(blurred, [&](int32_t row) {
            const int32_t kind = rows.kind[static_cast<size_t>(row)];
            return (kind != kDiskLight && kind != kConeLight) || !(s.motion.camera || s.light_moves(row));
        });
        s.lights(Part::kBlurredOutlines, std::move(blurred));
    }
    if (s.facts.options.max_depth > 1) suns_in_flat_mirrors(s);
    if (std::find(rows.kind.begin(), rows.kind.end(), kDiskLight) == rows.kind.end()) return;
    s.pierced(Part::kParallelDisks, [&](size_t row, size_t mesh) {
        return rows.kind[row] == kDiskLight && (s.motion.camera || s.motion.lights || s.moving[mesh]) &&
               (rows.visible_to[row] & s.tables.mesh_mask[mesh] & (1 << kCameraRay)) != 0;
    });
}

}  // namespace

void miss_seen_parts(const MissingSearch& s) {
    const CameraView& camera = s.facts.scene.camera;
    const auto boxes = s.kept.boxes.get(true, [&] { return MeshBoxes(s.tables); });
    std::vector<int32_t> large, closed, cut;
    const auto instances = mesh_instances(s.tables);
    for (int32_t mesh = 0; mesh < s.tables.visible_meshes; ++mesh) {
        const auto m = static_cast<size_t>(mesh);
        if (!s.motion.camera && !s.moving[m]) continue;
        const int32_t first = s.tables.mesh_first_face[m], last = s.tables.mesh_first_face[m + 1];
        if (last - first > kSelfIntersectionFaces) (s.closed[m] ? closed : large).push_back(mesh);
        if (mesh < s.tables.first_field() && !is_placed(instances[m]) && may_be_cut(camera, boxes->of[m]) &&
            is_cut(camera, s.tables, m))
            cut.push_back(mesh);
    }
    if (!closed.empty()) {
        const auto others = s.kept.not_star_shaped.get(closed, [&] { return not_star_shaped(s, closed); });
        large.insert(large.end(), others->begin(), others->end());
        std::sort(large.begin(), large.end());
    }
    s.meshes(Part::kSelfIntersections, std::move(large), kSelfIntersectionFaces);
    s.meshes(Part::kClipBorders, std::move(cut));
    wide_lens(s);
    disc_border(s);
    beyond_poles(s);
    s.meshes(Part::kTexelBorders, jumping_meshes(s.tables, s.motion, s.kept)->left_out);
    if (s.any_moves)
        s.materials(Part::kRayHistories, used_materials(s.tables, [&](size_t k) {
                        return any_step(s.tables, k, reads_ray_history<TextureInstruction>);
                    }));
    slid_textures(s);
    lights_by_parallel_rays(s);
}

}  // namespace edgegrad
