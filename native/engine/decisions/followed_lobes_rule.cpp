#include "engine/decisions/followed_lobes_rule.h"

#include <algorithm>
#include <cmath>

#include "boundary/curves/light_intersections.h"
#include "boundary/meshes/trees/placement.h"
#include "engine/decisions/decisions.h"
#include "engine/decisions/mirrored_edges.h"
#include "scene/face_vectors.h"
#include "scene/lights/light_list.h"
#include "scene/lights/light_params.h"
#include "scene/mesh_instances.h"
#include "scene/sharp_lobes.h"
#include "scene/textures/jumps.h"

namespace edgegrad {
namespace {

// Limits of alpha: in scenes with emissive meshes, with sized lights of the table, and in all others. Wider
// lobes have less noise if they are not followed: edges are sampled along them
// (boundary/terms/camera_sampled.h), which scan lines find only by chance, and lights are sampled. Where no
// lobe is followed, light keeps its direction near contact at more surfaces of a path
// (fixed_direction_surfaces). Fields have no other estimator for the light that they hide from narrower
// lobes.
constexpr float kFollowedByEmitters = 0.0205f, kFollowedByLights = 0.0505f, kFollowedAlpha = kWidestFollowed;
// For light of the table, the largest alpha of followed lobes as a multiple of the light's
// angular radius. Rays of wider lobes rarely meet the light. Emitter samples find it there, as for lobes that
// are not followed.
constexpr float kFollowedBySize = 0.8f;
// The slope of microfacet normals from which on emitter samples find the light of such lobes, as a multiple
// of the same radius. Lobes that are much narrower have a smaller one (tail_of_lobe,
// shading/bsdf/distributions/tail.h).
constexpr float kTailBySize = 1.0f;
// Emitter samples sample lobes up to this multiple of the angular radius of some light
// (path/lights/lobe_light.h).
constexpr float kSampledBySize = 0.5f;
// Number of places at which the size of lights is measured.
constexpr size_t kPlaces = 1024, kPlacesOfMesh = 64;

// Whether radiance may jump within a surface: a mesh has a textured material, or textures jump on a field.
// Fields have no seams.
bool may_jump_within_surfaces(const SceneTables& tables) {
    const auto& programs = tables.textures.closure_program;
    if (std::all_of(programs.begin(), programs.end(), [](int32_t program) { return program < 0; }))
        return false;
    const int32_t first =
        tables.fields.empty() ? static_cast<int32_t>(tables.face_material.size()) : tables.first_field_face();
    const auto end = static_cast<int32_t>(tables.face_material.size());
    for (int32_t face = 0; face < end; ++face) {
        const bool on_field = face >= first && face < first + static_cast<int32_t>(tables.fields.size());
        const auto jumps = [&](size_t k) {
            return programs[k] >= 0 && (!on_field || texture_jumps(tables, k).any());
        };
        if (any_closure(tables, static_cast<size_t>(tables.face_material[static_cast<size_t>(face)]), jumps))
            return true;
    }
    return false;
}

// Whether light of the table may jump within faces: at borders of spots without blend, for lights without
// size where smooth-shaded faces turn away from them, and behind smooth surfaces whose normals a map bends.
bool lights_jump(const SceneTables& tables, const LightView& lights) {
    const auto& flags = tables.closure_flags;
    if (lights.all_sized() > 0 &&
        std::any_of(flags.begin(), flags.end(), [](int32_t f) { return (f & kHasNormalMap) != 0; }))
        return true;
    if ((lights.kinds & kPointlikeLights) && !tables.corner_normal.empty()) return true;
    return !hard_cones(tables.lights).empty();
}

// Whether surfaces pass through lights anywhere in the scene.
bool lights_cross(const EdgeList& edges) {
    RequestedMotion all;
    all.moving.assign(static_cast<size_t>(edges.tables.visible_meshes), 1);
    all.camera = all.instances = all.lights = true;
    const Intersections found = find_intersections(edges, all, kScatteredRays | 1 << kShadowRay);
    return find_light_intersections(edges.tables, all, found, nullptr, edges.threads).size() > 0 ||
           find_disk_intersections(edges.tables, edges.threads).size() > 0;
}

float widest_followed(const SceneTables& tables, const LightView& lights) {
    const bool sized = lights.all_sized() > 0;
    if (lights.face_light && tables.fields.empty()) return kFollowedByEmitters;
    return sized ? kFollowedByLights : kFollowedAlpha;
}

// Places on surfaces with sharp lobes, spread over the faces and copies of meshes.
std::vector<Vector> places_on_lobes(const SceneTables& tables) {
    const auto narrow =
        marked_materials(tables, [&](size_t k) { return may_be_specular(tables, k, kSharpAlpha); });
    const MeshInstances instances = mesh_instances(tables);
    const size_t most = std::clamp<size_t>(kPlaces / std::max<size_t>(instances.size(), 1), 1, kPlacesOfMesh);
    std::vector<Vector> places;
    for (size_t mesh = 0; mesh < instances.size(); ++mesh) {
        const auto first = static_cast<size_t>(tables.mesh_first_face[mesh]),
                   count = static_cast<size_t>(tables.mesh_first_face[mesh + 1]) - first;
        const auto copies = instances[mesh];
        for (size_t k = 0, n = std::min(most, count * copies.size()); k < n; ++k) {
            const size_t face = first + (k * count / n + k) % count;
            if (!narrow[static_cast<size_t>(tables.face_material[face])]) continue;
            const Placement place = Placement::of(tables, copies[k * copies.size() / n]);
            places.push_back(place(face_corner(tables, face, 0)));
        }
    }
    return places;
}

// The angular radius of a light, the geometric mean over places.
double angular_radius(const LightNode& light, const std::vector<Vector>& places) {
    if (light.radius < 0.0f) return light.cos_o > 0.0f ? light.sin_o : 1.0;
    double sum = 0.0;
    for (const Vector& place : places) {
        const Vector way = place - vector_at(light.center);
        sum += std::log(1e-30 + dot(way, way));
    }
    return light.radius * std::exp(-0.5 * sum / static_cast<double>(std::max<size_t>(places.size(), 1)));
}

// The angular radius of each row of the light table; 0: it has no size.
std::vector<float> angular_radii(const SceneTables& tables, const LightView& lights) {
    std::vector<float> out(tables.lights.kind.size(), 0.0f);
    const auto places = lights.sized_count > 0 ? places_on_lobes(tables) : std::vector<Vector>{};
    for (int32_t k = 0; k < lights.all_sized(); ++k) {
        const int32_t row = lights.sized[k];
        const LightNode& node = lights.nodes[lights.node_of[lights.light_of_row[row]]];
        out[static_cast<size_t>(row)] = static_cast<float>(angular_radius(node, places));
    }
    return out;
}

// Whether light that narrow lobes throw on other surfaces has estimators for all its jumps
// (boundary/caustics/caustic_path.h). Normal maps turn reflections at random places, and distance fields and
// transparent surfaces are not searched before such lights.
bool throws_lights(const SceneTables& tables, float alpha) {
    const auto& flags = tables.closure_flags;
    if (!tables.fields.empty() || std::any_of(flags.begin(), flags.end(), [](int32_t f) {
            return (f & (kHasNormalMap | kHasTransparency)) != 0;
        }))
        return false;
    return partly_met_meshes(tables, kScatteredRays).empty() && !too_many_throw(tables, alpha);
}

}  // namespace

FollowedAlpha followed_alpha(const EdgeList& edges, const RequestedMotion& motion) {
    const SceneTables& tables = edges.tables;
    const LightView& lights = edges.lights->view();
    FollowedAlpha out;
    out.by_row = angular_radii(tables, lights);
    for (const float radius : out.by_row)
        out.lobe_samples = std::clamp(kSampledBySize * radius, out.lobe_samples, kSharpAlpha);
    // Flat faces reflect parallel rays in one direction. Whether it meets a sun is the same all over the
    // face, so that for a held microfacet normal the sun's outline is no curve in the picture.
    if (tables.camera.kind == kOrthographic)
        for (size_t row = 0; row < out.by_row.size(); ++row)
            if (tables.lights.kind[row] == kConeLight) out.by_row[row] = 0.0f;
    const float widest = widest_followed(tables, lights);
    if (!motion.any() || !may_be_specular(tables, widest) || may_jump_within_surfaces(tables) ||
        lights_jump(tables, lights) || *edges.kept.cross.get(true, [&] { return lights_cross(edges); }))
        out.by_row.clear();
    else
        out.all = widest;
    out.tail.assign(out.by_row.size(), 0.0f);
    for (size_t row = 0; row < out.by_row.size(); ++row)
        if (const float slope = kTailBySize * out.by_row[row]; slope > 0.0f)
            out.tail[row] = 1.0f / (slope * slope);
    // Fields have no other estimator for the light that they hide from followed lobes
    float largest = 0.0f;
    for (float& alpha : out.by_row) {
        if (alpha > 0.0f) alpha = tables.fields.empty() ? std::min(widest, kFollowedBySize * alpha) : widest;
        largest = std::max(largest, alpha);
    }
    // Lobes that show no light follow the environment alone, and are noisier beside lights
    if (largest > 0.0f) out.all = std::min(out.all, std::max(largest, kFollowedByEmitters));
    if (out.all > 0.0f && throws_lights(tables, out.all)) out.thrown = out.all;
    return out;
}

}  // namespace edgegrad
