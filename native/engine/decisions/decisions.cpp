#include "engine/decisions/decisions.h"

#include <algorithm>
#include <chrono>

#include "boundary/curves/texture_borders.h"
#include "boundary/meshes/trees/mesh_trees.h"
#include "engine/decisions/first_reason.h"
#include "engine/decisions/interior_rules.h"
#include "engine/decisions/mirrored_edges.h"
#include "scene/camera_row.h"
#include "scene/lights/light_params.h"
#include "scene/mesh_edges.h"
#include "scene/mesh_instances.h"

namespace edgegrad {

const char* const kReasonNames[] = {"needed",      "forced",         "not rendered",       "still",
                                    "black",       "alone",          "nothing between",    "flat",
                                    "none",        "no light",       "pointlike",          "out of view",
                                    "unseen",      "looks the same", "only outline moves", "unshaded",
                                    "rays differ", "not estimated",  "outlines serve",     "unread",
                                    "unused"};

namespace {

// Meshes with shading normals that may differ from their faces' normals.
std::vector<int32_t> bent_meshes(const SceneView& scene, const SceneTables& tables) {
    std::vector<uint8_t> mapped(tables.material_first_closure.size() - 1, 0);
    for (size_t m = 0; m < mapped.size(); ++m) mapped[m] = has_flags(tables, m, kHasNormalMap);
    std::vector<int32_t> out;
    for (int32_t mesh = 0; mesh < tables.visible_meshes; ++mesh) {
        const auto m = static_cast<size_t>(mesh);
        const int32_t first = tables.mesh_first_face[m], last = tables.mesh_first_face[m + 1];
        bool bent = false;
        for (int32_t face = first; face < last && !bent; ++face)
            bent = mapped[static_cast<size_t>(scene.face_material[face])] ||
                   (scene.corner_normal &&
                    std::any_of(scene.corner_normal + 3 * face, scene.corner_normal + 3 * face + 3,
                                [](int32_t c) { return c >= 0; }));
        if (bent) out.push_back(mesh);
    }
    return out;
}

// Whether horizons of faces move relative to the light that they cut off (boundary/terms/horizon.h). Fields
// are no lights, so only indirect light comes from them.
Reason moving_horizons(const BoundaryFacts& f, bool indirect) {
    const SceneView& scene = f.scene;
    const bool sized = scene.lights.all_sized() > 0;
    // Some lights face their receiver.
    const bool turns = scene.lights.kinds & kTurningLights;
    const RequestedMotion& m = f.motion;
    return unless(m.any_mesh_moves() || (indirect && m.any_field_moves()) || m.rotation ||
                      (m.lights && sized) || (m.camera && turns),
                  Reason::kStill);
}

void decide_horizons(const BoundaryFacts& f, Decisions& decided) {
    const SceneView& scene = f.scene;
    const RenderOptions& options = f.options;
    std::vector<int32_t> bent;
    if (scene.corner_normal || (scene.all_flags & kHasNormalMap)) bent = bent_meshes(scene, f.tables);
    const Reason exists = bent.empty() ? Reason::kNone : Reason::kNeeded;
    const auto decide = [&](Part part, bool indirect, bool lit) {
        const Reason rendered = unless(options.max_depth >= (indirect ? 3 : 2), Reason::kNotRendered);
        const Reason light = unless(lit, Reason::kPointlike);
        decided.decide(part, first_of({rendered, exists, light, moving_horizons(f, indirect)}));
        decided[part].meshes = bent;
    };
    if (options.terms[kShadowTerm])
        decide(Part::kHorizons, false, scene.has_environment || (scene.lights.kinds & ~kPointlikeLights));
    if (options.terms[kIndirectTerm]) decide(Part::kIndirectHorizons, true, true);
}

void decide_primary(const BoundaryFacts& f, Decisions& decided) {
    const RequestedMotion& m = f.motion;
    const Reason moves = unless(m.camera || m.any_mesh_moves(), Reason::kStill);
    decided.decide(Part::kPrimaryEdges, moves);
    Decision& edges = decided[Part::kPrimaryEdges];
    edges.edges.of = static_cast<int64_t>(f.tables.edge_vertices.size() / 2);
    if (moves == Reason::kNeeded) {
        decided.decide(Part::kUnseenMeshes, Reason::kUnseen);
        Decision& unseen = decided[Part::kUnseenMeshes];
        const std::vector<uint8_t> moving = moving_meshes(f.tables, m);
        int64_t swept = 0;
        for (int32_t mesh = 0; mesh < f.tables.visible_meshes; ++mesh) {
            const auto k = static_cast<size_t>(mesh);
            if (!m.camera && !moving[k]) continue;
            const auto [first, last] = mesh_edges(f.tables, k);
            swept += last - first;
            if (!m.camera) edges.meshes.push_back(mesh);  // else all meshes move
            if (f.tables.mesh_mask[k] & (1 << kCameraRay)) continue;
            unseen.meshes.push_back(mesh);
            unseen.edges.still += last - first;
        }
        edges.edges.still = edges.edges.of - swept;
    }
    decided.decide(Part::kSeenIntersections, moves);
    decided.decide(Part::kLightOutlines, unless(m.camera || m.lights, Reason::kStill));
    decided.decide(Part::kIntersectionOutlines,
                   f.scene.lights.sized_count == 0
                       ? Reason::kNoLight
                       : unless(m.camera || m.lights || m.any_mesh_moves(), Reason::kStill));
}

// Borders within faces at which textures jump, as the camera sees them.
void decide_texture_borders(const BoundaryFacts& f, Decisions& decided) {
    constexpr Part part = Part::kTextureBorders;
    if (!decided.decide(part, unless(f.motion.camera || f.motion.any_mesh_moves(), Reason::kStill))) return;
    RequestedMotion motion = f.motion;
    motion.camera |= decided.forces(part);
    decided[part].meshes = jumping_meshes(f.tables, motion, f.kept)->sampled;
    if (decided[part].meshes.empty()) decided.none(part, Reason::kNone);
}

// Outlines of fields that the camera sees, and curves along which they pass through other surfaces.
void decide_field_outlines(const BoundaryFacts& f, Decisions& decided) {
    std::vector<int32_t> seen;
    bool fields_move = false;
    for (size_t k = 0; k < f.tables.fields.size(); ++k) {
        const int32_t mesh = f.tables.first_field() + static_cast<int32_t>(k);
        if (!(f.tables.mesh_mask[static_cast<size_t>(mesh)] & (1 << kCameraRay))) continue;
        seen.push_back(mesh);
        fields_move |= f.motion.fields[k] != 0;
    }
    // Bands take what moves with fields and, if relaxed, with the camera
    const RequestedMotion& m = f.motion;
    const bool by_bands = f.scene.field_bands != nullptr, relaxed = by_bands && !m.warped;
    const bool moves = by_bands ? m.own_camera && !relaxed : m.own_camera || fields_move;
    const bool bands_move = by_bands && (fields_move || (relaxed && m.own_camera));
    if (f.options.field_edges != FieldEdges::kOutlines) {
        const Reason used = unless(bands_move, moves ? Reason::kOutlinesServe : Reason::kStill);
        decided.decide(Part::kFieldBands, first_of({unless(!seen.empty(), Reason::kNone), used}));
        decided[Part::kFieldBands].meshes = seen;
    }
    decided.decide(Part::kFieldOutlines,
                   first_of({unless(!seen.empty(), Reason::kNone), unless(moves, Reason::kStill)}));
    decided.decide(Part::kFieldCrossings,
                   first_of({unless(!seen.empty(), Reason::kNone),
                             unless(moves || f.motion.any_mesh_moves(), Reason::kStill)}));
    decided[Part::kFieldOutlines].meshes = std::move(seen);
}

// Fields that rays of `kinds` meet.
std::vector<int32_t> fields_met(const SceneTables& tables, int32_t kinds) {
    std::vector<int32_t> out;
    for (int32_t mesh = tables.first_field(); mesh < tables.visible_meshes; ++mesh)
        if (tables.mesh_mask[static_cast<size_t>(mesh)] & kinds) out.push_back(mesh);
    return out;
}

void decide_shadows(const BoundaryFacts& f, Reason black, Decisions& decided) {
    const RequestedMotion& m = f.motion;
    const SceneView& scene = f.scene;
    const bool lights = scene.lights.count > 0, meshes = m.any_mesh_moves() || m.any_field_moves();
    const Reason rendered = unless(f.options.max_depth >= 2, Reason::kNotRendered);
    const auto decide = [&](Part part, Reason exists, bool moves, Reason shape = Reason::kNeeded) {
        const bool any = moves || m.camera || meshes || m.lights || m.rotation;
        return decided.decide(part, first_of({rendered, unless(any, Reason::kStill), black, shape, exists,
                                              unless(moves, Reason::kStill)}));
    };
    // A single convex body occludes no light from itself.
    const Reason alone = unless(!scene.convex, Reason::kAlone);
    decide(Part::kLightShadows, unless(lights, Reason::kNoLight), meshes || m.camera || m.lights, alone);
    decide(Part::kEnvironmentShadows, unless(scene.has_environment, Reason::kNoLight),
           meshes || m.camera || m.rotation, alone);
    const bool sized = scene.lights.all_sized() > 0;
    // Of lights of the table these samples have shadows only behind the first surface
    const Reason beyond = f.options.max_depth > 2 ? unless(sized, Reason::kNoLight) : Reason::kNotRendered;
    decide(Part::kCameraSampledShadows,
           scene.has_environment || scene.lights.face_light ? Reason::kNeeded : beyond,
           meshes || m.camera || (sized && m.lights) || (scene.has_environment && m.rotation), alone);
    std::vector<int32_t> fields = fields_met(f.tables, ~(1 << kCameraRay));
    if (decide(Part::kFieldShadows,
               first_of({unless(!fields.empty(), Reason::kNone),
                         unless(lights || scene.has_environment, Reason::kNoLight)}),
               meshes || m.camera || m.lights || m.rotation))
        decided[Part::kFieldShadows].meshes = std::move(fields);
    // Fields do not emit light, but hide that of emissive meshes that they pass through.
    decide(Part::kCrossedLights,
           unless(f.tables.fields.empty() ? false : scene.lights.face_light != nullptr, Reason::kNone),
           scene.mesh_contact || meshes);
    for (Part part : {Part::kLightShadows, Part::kEnvironmentShadows})
        decided[part].edges.of = static_cast<int64_t>(f.tables.edge_vertices.size() / 2);
    if (decide(Part::kEmitterOutlines, unless(scene.face_fixed_direction != nullptr, Reason::kNone),
               meshes)) {
        const auto faces =
            static_cast<size_t>(f.tables.mesh_first_face[static_cast<size_t>(f.tables.visible_meshes)]);
        Decision& outlines = decided[Part::kEmitterOutlines];
        for (int32_t mesh = 0; scene.face_fixed_direction && faces && mesh < f.tables.visible_meshes;
             ++mesh) {
            const int32_t* fixed = scene.face_fixed_direction;
            const auto k = static_cast<size_t>(mesh);
            if (std::any_of(fixed + f.tables.mesh_first_face[k], fixed + f.tables.mesh_first_face[k + 1],
                            [](int32_t h) { return h != 0; }))
                outlines.meshes.push_back(mesh);
        }
        for (size_t k = 0; scene.material_fixed_direction && k + 1 < f.tables.material_first_closure.size();
             ++k)
            if (scene.material_fixed_direction[k]) outlines.materials.push_back(static_cast<int32_t>(k));
    }
    // Light of a fixed direction near contact moves over all intersections (scene/contact.h).
    const bool contact = scene.mesh_contact;
    const bool turning = m.camera && scene.lights.kinds >> kSphereLight & 1;
    decide(Part::kLightIntersections, unless(lights, Reason::kNoLight),
           contact || meshes || m.lights || turning);
    decide(Part::kDiskIntersections, unless(scene.lights.kinds >> kDiskLight & 1, Reason::kNoLight),
           m.camera || m.lights || meshes);
    std::vector<int32_t> cones = hard_cones(f.tables.lights);
    if (decide(Part::kConeBorders, unless(lights && !cones.empty(), Reason::kNoLight),
               m.camera || m.lights || meshes))
        decided[Part::kConeBorders].lights = std::move(cones);
}

void decide_indirect(const BoundaryFacts& f, Reason black, const std::vector<int32_t>& partly_met,
                     Decisions& decided) {
    const RequestedMotion& m = f.motion;
    const bool moves = m.camera || m.any_mesh_moves() || m.any_field_moves(), contact = f.scene.mesh_contact;
    const Reason rendered = unless(f.options.max_depth >= 3, Reason::kNotRendered),
                 between = unless(!f.nothing_between, Reason::kNothingBetween),
                 rays = unless(partly_met.empty(), Reason::kRaysDiffer);
    const auto decide = [&](Part part, bool moving) {
        decided.decide(part, first_of({rendered, unless(moving, Reason::kStill), black, between, rays}));
    };
    decide(Part::kIndirectEdges, moves);
    if (decided.at(Part::kIndirectEdges)->reason == Reason::kRaysDiffer)
        decided[Part::kIndirectEdges].meshes = partly_met;
    decided[Part::kIndirectEdges].edges.of = static_cast<int64_t>(f.tables.edge_vertices.size() / 2);
    decide(Part::kCameraSampledIndirect, moves);
    std::vector<int32_t> fields = fields_met(f.tables, kScatteredRays);
    decide(Part::kFieldsBetween, moves);
    if (fields.empty())
        decided.none(Part::kFieldsBetween, Reason::kNone);
    else
        decided[Part::kFieldsBetween].meshes = std::move(fields);
    decided.decide(Part::kContactBorders, first_of({rendered, unless(f.scene.sampled_borders, Reason::kNone),
                                                    unless(!f.scene.convex, Reason::kAlone),
                                                    unless(moves, Reason::kStill), black, rays}));
    decide(Part::kSurfaceIntersections, m.any_mesh_moves() || contact);
    decide(Part::kCrossedSurfaces, m.any_mesh_moves() || m.any_field_moves() || contact);
    if (f.tables.fields.empty()) decided.none(Part::kCrossedSurfaces, Reason::kNone);
}

}  // namespace

void decide_boundaries(const BoundaryFacts& f, Decisions& decided) {
    const RenderOptions& options = f.options;
    const bool lit = options.max_depth >= 2 && (options.terms[kShadowTerm] || options.terms[kIndirectTerm]);
    const Reason black = unless(!lit || !all_black(f.scene, f.tables), Reason::kBlack);
    if (options.terms[kPrimaryTerm]) decide_primary(f, decided);
    if (options.terms[kPrimaryTerm]) decide_texture_borders(f, decided);
    if (options.terms[kPrimaryTerm]) decide_field_outlines(f, decided);
    if (options.terms[kShadowTerm]) decide_shadows(f, black, decided);
    decide_horizons(f, decided);
    // The estimators of light between surfaces need all kinds of scattered rays to hit the same meshes.
    const std::vector<int32_t> partly_met = partly_met_meshes(f.tables, kScatteredRays);
    if (options.terms[kIndirectTerm]) decide_indirect(f, black, partly_met, decided);
    decide_mirrored(f, partly_met, decided);
    decide_caustics(f, partly_met, decided);
}

namespace {

// Adds a pair, unless it is the last one: lines come in the order of their surfaces.
void add_pair(MeshPairs& pairs, const std::array<int32_t, 2>& pair) {
    if (pairs.empty() || pairs.back() != pair) pairs.push_back(pair);
}

// Sorts pairs, and keeps each once.
MeshPairs each_once(MeshPairs pairs) {
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    return pairs;
}

}  // namespace

bool Decisions::found(Part part, const SceneTables& tables, const Intersections& lines) {
    if (lines.size() == 0) {
        none(part, Reason::kNone);
        return false;
    }
    MeshPairs pairs, lights;
    for (size_t k = 0; k < static_cast<size_t>(lines.size()); ++k) {
        const LineSurface one(lines.faces[2 * k]), other(lines.faces[2 * k + 1]);
        const int32_t mesh = mesh_of(tables, one.face());
        if (other.is_light()) {
            add_pair(lights, {other.light_row(), mesh});
        } else {
            const int32_t second = mesh_of(tables, other.face());
            add_pair(pairs, {std::min(mesh, second), std::max(mesh, second)});
        }
    }
    Decision& d = (*this)[part];
    d.pairs = each_once(std::move(pairs));
    d.pierced = each_once(std::move(lights));
    return true;
}

void Decisions::found_coincident(const SceneTables& tables, const Intersections& lines,
                                 const RequestedMotion& motion) {
    MeshPairs pairs;
    for (const auto& faces : lines.coincident) {
        const int32_t a = mesh_of(tables, faces[0]), b = mesh_of(tables, faces[1]);
        if (motion.camera || motion.moving[static_cast<size_t>(a)] || motion.moving[static_cast<size_t>(b)])
            add_pair(pairs, {std::min(a, b), std::max(a, b)});
    }
    if (!pairs.empty()) missing(Part::kCoincidentFaces).pairs = each_once(std::move(pairs));
}

void Decisions::found_parting(const BoundaryFacts& facts, const Requested& requested, int threads) {
    const SceneTables& tables = facts.tables;
    MovingMeshes moving{facts.motion.moving, std::vector<uint8_t>(tables.instance_mesh.size(), 0)};
    for (const FloatSpan& s : requested.floats().of(FloatTable::kInstances))
        for (size_t k = s.first / 12; k < moving.instances.size() && 12 * k < s.last; ++k)
            moving.instances[k] = 1;
    MeshPairs pairs;
    for (const auto& [a, b] : tables.touching_meshes)
        if (moving.meshes[static_cast<size_t>(a)] != moving.meshes[static_cast<size_t>(b)])
            pairs.push_back({std::min(a, b), std::max(a, b)});
    const auto boxes = facts.kept.boxes.get(true, [&] { return MeshBoxes(tables); });
    const auto touching = facts.kept.touching.get(moving, [&] {
        const auto trees = facts.kept.trees.get(true, [&] { return MeshTrees(tables); });
        return touching_meshes(tables, moving, *boxes, *trees, threads);
    });
    pairs.insert(pairs.end(), touching->begin(), touching->end());
    if (!pairs.empty()) missing(Part::kPartingMeshes).pairs = each_once(std::move(pairs));
}

bool Decisions::lists_materials(Part part, std::vector<int32_t> materials) {
    if (materials.empty()) none(part, Reason::kNone);
    (*this)[part].materials = std::move(materials);
    return computes(part);
}

std::vector<int32_t> hard_cones(const SceneTables::LightRows& lights) {
    std::vector<int32_t> rows;
    for (size_t row = 0; row < lights.kind.size(); ++row)
        if ((lights.flags[row] & (kLightCone | kLightLinearCone)) &&
            lights.params[kLightParams * row + kLightEdgeScale] >= 0.5f * kLightStep)
            rows.push_back(static_cast<int32_t>(row));
    return rows;
}

std::vector<int32_t> partly_met_meshes(const SceneTables& tables, int32_t rays) {
    std::vector<int32_t> out;
    for (int32_t mesh = 0; mesh < tables.visible_meshes; ++mesh) {
        const int32_t met = tables.mesh_mask[static_cast<size_t>(mesh)] & rays;
        if (met != 0 && met != rays) out.push_back(mesh);
    }
    return out;
}

bool moves_rays(const CameraView& camera, const FloatSpans& requested) {
    const auto any = [&](size_t first, size_t last) {
        return requested.any(FloatTable::kCamera, first, last);
    };
    if (any(kCameraPosition, kCameraFocal)) return true;
    if (camera.kind == kEquirectangular) return any(kCameraPanorama, kCameraFisheye);
    if (is_fisheye(camera.kind))
        return any(kCameraFocal, kCameraPanorama) || any(kCameraFisheye, kCameraDisc);
    if (any(kCameraFocal, kCameraPanorama)) return true;
    if (!(camera.aperture_radius > 0.0f)) return false;
    const bool polygon = camera.aperture_blades >= 3;
    return any(kCameraApertureRadius, kCameraApertureRotation) ||
           (polygon && any(kCameraApertureRotation, kCameraApertureRatio)) ||
           any(kCameraApertureRatio, kCameraFloats);
}

namespace {

int64_t now() {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(
               std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

}  // namespace

PartClock::Running::Running(std::atomic<int64_t>& total) : total_(total), start_(now()) {}
PartClock::Running::~Running() { total_.fetch_add(now() - start_, std::memory_order_relaxed); }

}  // namespace edgegrad
