#include "engine/terms/curve_terms.h"

#include "boundary/curves/light_intersections.h"
#include "boundary/curves/segment_cells.h"
#include "boundary/curves/texture_borders.h"
#include "boundary/fields/field_crossings.h"
#include "boundary/fields/field_curves.h"
#include "engine/terms/outline_cells.h"
#include "tasks/boundary_kind.h"
#include "tasks/boundary_task.h"

namespace edgegrad {
namespace {

// Number of segments of a curve about a light.
constexpr int kTurnSegments = 64;

// Adds intersection curves with all directions about them.
void add_lines(const SceneView& scene, const EdgeList& edges, const RenderOptions& options, BoundaryKind kind,
               Intersections found, Decisions& decided, std::vector<CurveTerm>& out) {
    if (!decided.found(kBoundaryTable[kind].part, edges.tables, found) || decided.alone()) return;
    const BoundaryKindRow& row = kBoundaryTable[kind];
    auto lines = std::make_shared<EdgesAndIntersections>(edges.tables, std::move(found));
    const double picture = static_cast<double>(scene.camera.width) * scene.camera.height * options.samples;
    const double segments = kDirectionSegments * row.share * picture;
    Candidates candidates = over_directions(lines->intersections(), segments, row.chains(options.max_depth));
    out.push_back({kind, std::move(candidates), std::move(lines)});
}

// Adds curves as the camera sees them, unless they are out of view, which decisions do not look for.
void add_seen_lines(BoundaryKind kind, const SceneView& scene, const EdgeList& edges, Intersections found,
                    std::vector<CurveTerm>& out) {
    auto lines = std::make_shared<EdgesAndIntersections>(edges.tables, std::move(found));
    Candidates candidates;
    lines->add_candidates(scene.camera, candidates);
    if (candidates.size() > 0) out.push_back({kind, std::move(candidates), std::move(lines)});
}

void add_intersections(const SceneView& scene, const EdgeList& edges, const RenderOptions& options,
                       const RequestedMotion& motion, const Intersections* seen, Decisions& decided,
                       std::vector<CurveTerm>& out) {
    const bool lights = decided.computes(Part::kLightIntersections);
    const bool surfaces = decided.computes(Part::kSurfaceIntersections);
    if (!lights && !surfaces) return;
    const bool forced =
        decided.forces(Part::kLightIntersections) || decided.forces(Part::kSurfaceIntersections);
    const bool meshes = motion.any_mesh_moves();
    // Light of a fixed direction near contact (scene/contact.h) moves over all intersections. Otherwise the
    // motion of the camera alone moves no intersection relative to its surfaces.
    const bool contact = scene.mesh_contact || forced;
    RequestedMotion moving = motion;
    moving.camera = contact, moving.lights |= forced;
    Intersections intersections;
    if ((meshes || contact) && (surfaces || (lights && scene.lights.face_light)))
        intersections = seen && !scene.rays_differ && !forced
                            ? moving_intersections(edges.tables, moving, *seen)
                            : find_intersections(edges, moving, kScatteredRays | 1 << kShadowRay);
    if (lights)
        add_lines(scene, edges, options, kLightIntersection,
                  find_light_intersections(edges.tables, moving, intersections, scene.lights.face_light,
                                           edges.threads),
                  decided, out);
    if (surfaces)
        add_lines(scene, edges, options, kSurfaceIntersection, std::move(intersections), decided, out);
}

// The same for disks, which face their receiver: any motion moves them relative to surfaces.
void add_disk_intersections(const SceneView& scene, const EdgeList& edges, const RenderOptions& options,
                            Decisions& decided, std::vector<CurveTerm>& out) {
    if (!decided.computes(Part::kDiskIntersections)) return;
    add_lines(scene, edges, options, kDiskIntersection, find_disk_intersections(edges.tables, edges.threads),
              decided, out);
}

// The curve about a light, divided into segments.
void add_turns(SegmentCell light, double mass, Candidates& out) {
    for (int k = 0; k < kTurnSegments; ++k) {
        out.add(0, static_cast<float>(k) / kTurnSegments, static_cast<float>(k + 1) / kTurnSegments, mass);
        out.cell.push_back(light);
    }
}

void add_cones(const SceneView& scene, const EdgeList& edges, const RenderOptions& options,
               Decisions& decided, std::vector<CurveTerm>& out) {
    if (!decided.computes(Part::kConeBorders)) return;
    const bool chains = kBoundaryTable[kConeBorder].chains(options.max_depth);
    Candidates cones;
    for (int chained = 0; chained < (chains ? 2 : 1); ++chained) {
        const double share = share_of_mass(chains, chained != 0);
        for (const int32_t row : hard_cones(edges.tables.lights))
            if (scene.lights.light_of_row[row] >= 0) add_turns({row, chained != 0}, share, cones);
    }
    if (cones.size() == 0) return decided.none(Part::kConeBorders, Reason::kNoLight);
    out.push_back({kConeBorder, std::move(cones), nullptr});
}

void add_outlines(const SceneView& scene, const EdgeList& edges, Decisions& decided,
                  std::vector<CurveTerm>& out) {
    if (!decided.computes(Part::kLightOutlines)) return;
    const SceneTables::LightRows& lights = edges.tables.lights;
    Candidates outlines;
    const bool parallel = scene.camera.kind == kOrthographic;
    // Parallel rays see either the whole sun or no part of it.
    const int32_t count = scene.lights.sized_count + (parallel ? 0 : scene.lights.sized_distant);
    for (int32_t k = 0; k < count; ++k) {
        const int32_t row = scene.lights.sized[k];
        const int32_t kind = lights.kind[static_cast<size_t>(row)];
        if (!(lights.visible_to[static_cast<size_t>(row)] & (1 << kCameraRay))) continue;
        // Rays from one point of the lens are parallel, but not perpendicular to the camera's plane, which
        // contains the ray origins that disks face.
        if (kind == kDiskLight && parallel && scene.camera.aperture_radius > 0.0f) continue;
        add_turns({row, false}, 1.0, outlines);
        decided[Part::kLightOutlines].lights.push_back(row);
    }
    if (outlines.size() == 0) return decided.none(Part::kLightOutlines, Reason::kNoLight);
    out.push_back({kLightOutline, std::move(outlines), nullptr});
}

// Outlines, in the picture, of lights that meshes pass through.
void add_intersection_outlines(const SceneView& scene, const EdgeList& edges, const RequestedMotion& motion,
                               Decisions& decided, std::vector<CurveTerm>& out) {
    if (!decided.computes(Part::kIntersectionOutlines)) return;
    // Parallel rays have different origins, each of which the disk would face.
    const bool disks = scene.camera.kind != kOrthographic;
    RequestedMotion moving = motion;
    moving.camera |= decided.forces(Part::kIntersectionOutlines);
    Intersections found = find_seen_lights(edges.tables, moving, disks, edges.threads);
    if (!decided.found(Part::kIntersectionOutlines, edges.tables, found)) return;
    auto lines = std::make_shared<EdgesAndIntersections>(edges.tables, std::move(found));
    Candidates candidates = lines->intersections();
    out.push_back({kIntersectionOutline, std::move(candidates), std::move(lines)});
}

// Outlines of the fields that the part lists, as the camera sees them.
void add_field_outlines(const SceneView& scene, const EdgeList& edges, const RenderOptions& options,
                        Decisions& decided, std::vector<CurveTerm>& out) {
    if (!decided.computes(Part::kFieldOutlines) || decided.alone()) return;
    add_seen_lines(kFieldOutline, scene, edges,
                   *seen_outlines(scene, edges, decided[Part::kFieldOutlines].meshes, options.seed), out);
}

// Curves where fields pass through surfaces that scatter light or emit it.
void add_crossed_surfaces(const SceneView& scene, const EdgeList& edges, const RenderOptions& options,
                          const RequestedMotion& motion, Decisions& decided, std::vector<CurveTerm>& out) {
    const bool lights = decided.computes(Part::kCrossedLights),
               surfaces = decided.computes(Part::kCrossedSurfaces);
    if (!lights && !surfaces) return;
    // Light of a fixed direction near contact (scene/contact.h) moves over all curves
    RequestedMotion moving = motion;
    moving.camera =
        scene.mesh_contact || decided.forces(Part::kCrossedLights) || decided.forces(Part::kCrossedSurfaces);
    const auto kept = edges.kept.lit_crossings.get({moving, kScatteredRays | 1 << kShadowRay}, [&] {
        return field_crossings(edges, moving, kScatteredRays | 1 << kShadowRay);
    });
    const Intersections& all = *kept;
    const auto select = [&](const auto& counts) {
        Intersections found;
        for (int64_t k = 0; k < all.size(); ++k) {
            const auto at = 2 * static_cast<size_t>(k);
            const auto other = static_cast<int32_t>(all.faces[at + 1]);
            if (counts(other)) found.add(all, k);
        }
        return found;
    };
    const int32_t* of_face = scene.lights.face_light;  // null: no mesh emits light
    if (lights)
        add_lines(scene, edges, options, kCrossedLight,
                  select([&](int32_t face) { return of_face && of_face[face] >= 0; }), decided, out);
    if (surfaces)
        add_lines(scene, edges, options, kCrossedSurface, select([](int32_t) { return true; }), decided, out);
}

// Lines where fields that the camera sees pass through other surfaces.
void add_field_crossings(const SceneView& scene, const EdgeList& edges, const RequestedMotion& motion,
                         Decisions& decided, std::vector<CurveTerm>& out) {
    if (!decided.computes(Part::kFieldCrossings)) return;
    RequestedMotion moving = motion;
    moving.camera |= decided.forces(Part::kFieldCrossings);
    Intersections found = *edges.kept.seen_crossings.get(
        {moving, 1 << kCameraRay}, [&] { return field_crossings(edges, moving, 1 << kCameraRay); });
    if (!decided.found(Part::kFieldCrossings, edges.tables, found) || decided.alone()) return;
    add_seen_lines(kFieldCrossing, scene, edges, std::move(found), out);
}

// Borders at which textures jump, on the meshes that the part lists.
void add_texture_borders(const SceneView& scene, const EdgeList& edges, Decisions& decided,
                         std::vector<CurveTerm>& out) {
    if (!decided.computes(Part::kTextureBorders) || decided.alone()) return;
    add_seen_lines(kTextureBorder, scene, edges,
                   texture_borders(edges, decided[Part::kTextureBorders].meshes), out);
}

// Bands about the outlines of fields.
void add_field_bands(const SceneView& scene, const EdgeList& edges, const RenderOptions& options,
                     const RequestedMotion& motion, Decisions& decided, std::vector<CurveTerm>& out) {
    if (!decided.computes(Part::kFieldBands) || decided.alone()) return;
    const BoundaryKind kind = motion.warped ? kWarpedPicture : kFieldBand;
    Intersections found = *seen_outlines(scene, edges, decided[Part::kFieldBands].meshes, options.seed);
    double pixels = 0.0;
    for (int32_t k = 0; k < scene.field_count; ++k)
        pixels = std::max(pixels, static_cast<double>(scene.field_bands[k].pixels));
    const double picture = static_cast<double>(scene.camera.width) * scene.camera.height * options.samples;
    Candidates candidates = outline_cells(scene.camera, found, scene.edge_count, pixels,
                                          kPictureSegments * kBoundaryTable[kind].share * picture);
    if (candidates.size() == 0) return;
    out.push_back({kind, std::move(candidates),
                   std::make_shared<EdgesAndIntersections>(edges.tables, std::move(found))});
}

// Fields between surfaces, and between surfaces and lights.
void add_fields_between(const SceneView& scene, const EdgeList& edges, const RenderOptions& options,
                        Decisions& decided, std::vector<CurveTerm>& out) {
    if (decided.alone()) return;
    // `directions`: whether samples are divided by cells of directions, too
    const auto add = [&](BoundaryKind kind, const std::shared_ptr<const FieldLines>& found, bool directions) {
        if (found->all.size() == 0) return;
        const BoundaryKindRow& row = kBoundaryTable[kind];
        const double picture =
            static_cast<double>(scene.camera.width) * scene.camera.height * options.samples;
        const double segments = directions ? kDirectionSegments * row.share * picture : 0.0;
        const bool chains = row.chains(options.max_depth);
        const auto candidates = found->in_cells->get(
            {segments, chains}, [&] { return over_directions(found->all, segments, chains); });
        out.push_back({kind, candidates, {found, &found->lines}});
    };
    if (decided.computes(Part::kFieldShadows)) {
        const std::vector<int32_t>& lit = decided[Part::kFieldShadows].meshes;
        add(kFieldLights, lit_outlines(scene, edges, lit), false);
        add(kFieldSizedLights, field_patches(scene, edges, lit, TouchedBy::kSizedLights), false);
        if (scene.has_environment)
            add(kFieldEnvironment, field_patches(scene, edges, lit, TouchedBy::kAllDirections), true);
    }
    if (decided.computes(Part::kFieldsBetween)) {
        const std::vector<int32_t>& between = decided[Part::kFieldsBetween].meshes;
        add(kFieldIndirect, field_patches(scene, edges, between, TouchedBy::kAllDirections), true);
    }
}

}  // namespace

std::vector<CurveTerm> curve_terms(const SceneView& scene, const EdgeList& edges,
                                   const RenderOptions& options, const RequestedMotion& motion,
                                   const Intersections* seen, Decisions& decided) {
    std::vector<CurveTerm> out;
    add_outlines(scene, edges, decided, out);
    add_intersection_outlines(scene, edges, motion, decided, out);
    add_field_outlines(scene, edges, options, decided, out);
    add_field_crossings(scene, edges, motion, decided, out);
    add_texture_borders(scene, edges, decided, out);
    add_field_bands(scene, edges, options, motion, decided, out);
    add_fields_between(scene, edges, options, decided, out);
    add_crossed_surfaces(scene, edges, options, motion, decided, out);
    add_intersections(scene, edges, options, motion, seen, decided, out);
    add_disk_intersections(scene, edges, options, decided, out);
    add_cones(scene, edges, options, decided, out);
    return out;
}

}  // namespace edgegrad
