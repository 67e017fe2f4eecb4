#include "engine/call_scene.h"

#include <cmath>
#include <numbers>

#include "boundary/curves/edge_cache.h"
#include "boundary/curves/texture_borders.h"
#include "boundary/fields/field_insides.h"
#include "boundary/meshes/coplanar_polygons.h"
#include "engine/decisions/decisions.h"
#include "scene/contact_meshes.h"
#include "scene/mesh_instances.h"
#include "scene/sharp_lobes.h"
#include "scene/table_rows.h"
#include "scene/textures/jumps.h"

namespace edgegrad {

namespace {

// Light has a fixed direction from at least this number of emissive faces of a mesh, in lobes of at most this
// alpha.
constexpr float kFixedDirectionAlpha = 0.25f;
constexpr int kLeastFixedDirectionFaces = 8;

// The mean of Cycles' least alpha behind a diffuse bounce over the cosines c of its directions (derivations,
// U). With k = 1/(pi g),
//   int_0^1 2 c sqrt(max(0, 1 - k c)) / 2 dc = k^-2 [2/3 u^(3/2) - 2/5 u^(5/2)] from max(0, 1 - k) to 1.
float least_alpha_behind_diffuse(float g) {
    if (g <= 0.0f) return 0.0f;
    const double k = 1.0 / (std::numbers::pi * static_cast<double>(g)), u = std::max(0.0, 1.0 - k);
    // For small k the difference would cancel
    if (k < 1e-3) return static_cast<float>(0.5 * (1.0 - k / 3.0));
    const double at_u = std::pow(u, 1.5) * (2.0 / 3.0 - 0.4 * u);
    return static_cast<float>((2.0 / 3.0 - 0.4 - at_u) / (k * k));
}

}  // namespace

// Selects the light that has a fixed direction (shading/lights/fixed_direction_light.h): that of moving
// meshes with many emissive faces, on surfaces with sharp lobes, if only faces emit and occlude light.
void PreparedScene::hold_directions(const SceneTables& tables, const RequestedMotion& motion) {
    if (!view_.lights.face_light || !tables.fields.empty() || view_.emission_varies || view_.rays_differ ||
        view_.lights.any_linked || (view_.all_flags & kHasTransparency))
        return;
    std::vector<int32_t> faces(tables.face_material.size(), 0),
        materials(tables.material_first_closure.size() - 1, 0);
    bool gives = false, receives = false;
    const auto instances = mesh_instances(tables);
    for (size_t mesh = 0; mesh < static_cast<size_t>(tables.visible_meshes); ++mesh) {
        if (!motion.moving[mesh] || is_placed(instances[mesh])) continue;
        const int32_t first = tables.mesh_first_face[mesh], last = tables.mesh_first_face[mesh + 1];
        const auto emits = [&](int32_t face) { return view_.lights.face_light[face] >= 0; };
        int count = 0;
        for (int32_t face = first; face < last; ++face) count += emits(face);
        if (count < kLeastFixedDirectionFaces) continue;
        gives = true;
        for (int32_t face = first; face < last; ++face) faces[static_cast<size_t>(face)] = emits(face);
    }
    for (size_t m = 0; m < materials.size(); ++m) {
        materials[m] = any_closure(tables, m, [&](size_t closure) {
            return !(view_.textures.closure_program && view_.textures.closure_program[closure] >= 0) &&
                   has_sharp_lobe(tables, closure, kFixedDirectionAlpha);
        });
        receives |= materials[m] != 0;
    }
    if (!gives || !receives) return;
    face_fixed_direction_ = std::move(faces);
    material_fixed_direction_ = std::move(materials);
    view_.face_fixed_direction = face_fixed_direction_.data();
    view_.material_fixed_direction = material_fixed_direction_.data();
}

PreparedScene::PreparedScene(const embree::Api& api, const Bvh* bvh, const SceneTables& tables,
                             const RequestedMotion* motion, bool convex,
                             std::shared_ptr<const LightList> lights, float filter_glossy,
                             FollowedAlpha followed, EdgeCache* kept, std::vector<FieldBand> bands)
    : lights_(std::move(lights)),
      followed_(std::move(followed)),
      brute_triangles_(brute_triangles(tables)),
      field_bands_(std::move(bands)),
      face_moving_(tables.face_material.size(), 0) {
    for (size_t m = 0; motion && m < motion->moving.size(); ++m)
        if (motion->moving[m])
            std::fill(face_moving_.begin() + tables.mesh_first_face[m],
                      face_moving_.begin() + tables.mesh_first_face[m + 1], kVerticesMove);
    for (size_t k = 0; motion && k < motion->fields.size(); ++k)
        if (motion->fields[k]) face_moving_[static_cast<size_t>(tables.first_field_face()) + k] = kFieldMoves;
    view_.api = &api;
    view_.convex = convex;
    view_.least_alpha = least_alpha_behind_diffuse(filter_glossy);
    view_.bvh = bvh ? bvh->handle() : nullptr;
    view_.brute_triangles = brute_triangles_.data();
    view_.brute_count = static_cast<int32_t>(brute_triangles_.size());
    int64_t first_value = 0;
    for (const FieldTable& field : tables.fields) {
        fields_.push_back(field.view());
        fields_.back().number = static_cast<int32_t>(fields_.size()) - 1;
        fields_.back().first_value = first_value;
        first_value += fields_.back().value_count();
    }
    if (motion && kept && !fields_.empty()) {
        const std::vector<uint8_t> inside = lit_insides(tables, *kept);
        for (size_t k = 0; k < fields_.size(); ++k) fields_[k].inside = inside[k] != 0;
    }
    view_.fields = fields_.data();
    view_.field_bands = field_bands_.empty() ? nullptr : field_bands_.data();
    view_.field_count = static_cast<int32_t>(fields_.size());
    view_.first_field_face = fields_.empty() ? 0 : tables.first_field_face();
    view_.vertices = rows_of(tables.vertices);
    view_.faces = rows_of(tables.faces);
    view_.face_material = rows_of(tables.face_material);
    view_.face_moving = rows_of(face_moving_);
    view_.mesh_first_face = rows_of(tables.mesh_first_face);
    view_.mesh_count = tables.visible_meshes;
    view_.mesh_mask = rows_of(tables.mesh_mask);
    constexpr int32_t all_rays = (1 << kFirstBlockers) - 1;
    view_.rays_differ =
        std::any_of(tables.mesh_mask.begin(), tables.mesh_mask.begin() + tables.visible_meshes,
                    [](int32_t mask) { return (mask & all_rays) != all_rays; });
    view_.mesh_receivers = rows_of(tables.mesh_receivers);
    view_.mesh_terminator = rows_of(tables.mesh_terminator);
    view_.any_terminator = !tables.corner_normal.empty() &&
                           std::any_of(tables.mesh_terminator.begin(), tables.mesh_terminator.end(),
                                       [](float t) { return t > 0.0f; });
    view_.mesh_dimming = rows_of(tables.mesh_dimming);
    view_.any_dimming = std::any_of(tables.mesh_dimming.begin(), tables.mesh_dimming.end(),
                                    [](float factor) { return factor > 1.0f; });
    view_.corner_normal = tables.corner_normal.empty() ? nullptr : tables.corner_normal.data();
    view_.normals = rows_of(tables.normals);
    view_.instance_mesh = rows_of(tables.instance_mesh);
    view_.instance_to_world = rows_of(tables.instance_to_world);
    view_.material_first_closure = rows_of(tables.material_first_closure);
    view_.closure_kind = rows_of(tables.closure_kind);
    view_.closure_flags = rows_of(tables.closure_flags);
    view_.closure_params = rows_of(tables.closure_params);
    view_.any_medium = any_medium(tables);
    view_.media = tables.media.data();
    view_.world_medium = tables.world_medium;
    view_.textures = tables.textures.view();
    // Materials that no visible face has do not make the kernels slower
    view_.all_flags = 0;
    view_.common_flags = ~0;
    for (size_t m = 0; m < tables.material_used.size(); ++m) {
        if (!tables.material_used[m]) continue;
        const int32_t first = tables.material_first_closure[m], last = tables.material_first_closure[m + 1];
        view_.any_mixture |= last - first > 1;
        for (int32_t closure = first; closure < last; ++closure) {
            const int32_t flags = tables.closure_flags[static_cast<size_t>(closure)];
            view_.all_flags |= flags;
            view_.common_flags &= flags;
            const bool textured =
                view_.textures.closure_program && (view_.textures.closure_program[closure] >= 0 ||
                                                   view_.textures.closure_weight_program[closure] >= 0);
            // Coat and sheen absorb a fraction that depends on the direction.
            const float* row = view_.closure_params + static_cast<ptrdiff_t>(closure) * kMaterialParams;
            const bool layered = row[kCoatWeight] > 0.0f || row[kSheenWeight] > 0.0f;
            if ((flags & kHasEmission) &&
                (last - first > 1 || textured || layered || (flags & kHasTransparency)))
                view_.emission_varies = true;
        }
    }
    if (tables.environment_map) {
        view_.environment_image = tables.environment_map->view();
        view_.environment_image.sampled = (tables.environment_mask & kScatteredRays) == kScatteredRays;
    }
    std::copy_n(tables.environment_rotation, 9, view_.environment_rotation);
    view_.environment_mask = tables.environment_mask;
    if (lights_) view_.lights = lights_->view();
    view_.emission = rows_of(tables.emission);
    view_.emission_two_sided = rows_of(tables.emission_two_sided);
    std::copy_n(tables.environment, 3, view_.environment);
    view_.has_environment =
        (motion && motion->environment) ||
        std::any_of(view_.environment, view_.environment + 3, [](float e) { return e > 0.0f; });
    view_.edge_vertices = rows_of(tables.edge_vertices);
    view_.edge_face_first = rows_of(tables.edge_face_first);
    view_.edge_faces = rows_of(tables.edge_faces);
    view_.edge_opposite = rows_of(tables.edge_opposite);
    view_.edge_sharing = tables.edge_sharing.empty() ? nullptr : tables.edge_sharing.data();
    view_.face_collinear = tables.face_collinear.empty() ? nullptr : tables.face_collinear.data();
    view_.intersection_ends = zero_row<float>();
    view_.edge_count = static_cast<int32_t>(tables.edge_vertices.size() / 2);
    view_.camera = tables.camera;
    view_.camera.filter = tables.filter.empty() ? nullptr : tables.filter.data();
    if (!motion) return;
    view_.any_perfect = !used_materials(tables, [&](size_t k) { return may_be_specular(tables, k); }).empty();
    view_.lobe_samples = followed_.lobe_samples;
    view_.followed_alpha = view_.least_followed = followed_.all;
    view_.thrown_alpha = followed_.thrown;
    if (!followed_.by_row.empty()) {
        view_.light_followed = followed_.by_row.data();
        view_.light_tail = followed_.tail.data();
        view_.any_tail =
            std::any_of(followed_.tail.begin(), followed_.tail.end(), [](float t) { return t > 0.0f; });
        for (int32_t k = 0; k < view_.lights.all_sized(); ++k)
            view_.least_followed =
                std::min(view_.least_followed, view_.light_followed[view_.lights.sized[k]]);
    }
    hold_directions(tables, *motion);
    if (kept && (motion->camera || motion->any_mesh_moves())) {
        jumps_ = kept_jumps(tables, *kept);
        view_.material_jumps = jumps_->any.empty() ? nullptr : jumps_->any.data();
    }
    if (kept) blend_near_contact(tables, *motion, *kept);
}

void PreparedScene::blend_near_contact(const SceneTables& tables, const RequestedMotion& motion,
                                       EdgeCache& kept) {
    // Where emissive meshes have a fixed direction anyway (shading/lights/fixed_direction_light.h), no others
    // need it.
    if (view_.face_fixed_direction || (!motion.camera && !motion.any_mesh_moves())) return;
    contact_materials_ = kept.contact_materials.get(
        true, [&] { return contact_materials(tables, *kept_jumps(tables, kept)); });
    mesh_contact_ =
        kept.contact_meshes.get(true, [&] { return contact_meshes(tables, contact_materials_->bits); });
    if (mesh_contact_->empty()) return;
    view_.mesh_contact = mesh_contact_->data();
    view_.material_first_grid = contact_materials_->first_grid.data();
    view_.cell_attributes = rows_of(contact_materials_->grid_attributes);
    view_.cell_rows = rows_of(contact_materials_->grid_rows);
    mesh_size_ = kept.mesh_sizes.get(true, [&] { return mesh_sizes(tables); });
    view_.mesh_size = mesh_size_->data();
    // Samples along edges need all kinds of scattered rays to hit the same meshes.
    const auto any = [&](int32_t bit) {
        return std::any_of(mesh_contact_->begin(), mesh_contact_->end(), [&](int32_t m) { return m & bit; });
    };
    view_.sampled_borders =
        any(kContactWide) && any(kContactOpen) && partly_met_meshes(tables, kScatteredRays).empty();
    // Behind perfect lobes, points are in material form.
    view_.fixed_direction_surfaces =
        may_be_specular(tables, view_.followed_alpha) ? 1 : kFixedDirectionSurfaces;
    const auto regions = kept.regions.get(true, [&] { return surface_regions(tables); });
    polygons_ = kept.polygons.get(true, [&] { return coplanar_polygons(tables, *regions); });
    if (!polygons_->face.empty()) {
        view_.face_polygon = polygons_->face.data();
        view_.polygon_sides = polygons_->sides.data();
    }
    transparent_boxes_ = kept.transparent_boxes.get(true, [&] { return transparent_boxes(tables); });
    view_.transparent_boxes = transparent_boxes_->data();
    view_.transparent_box_count = static_cast<int32_t>(transparent_boxes_->size() / 6);
}

}  // namespace edgegrad
