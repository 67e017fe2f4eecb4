#include "engine/terms/curve_terms.h"

#include <algorithm>

#include "boundary/curves/light_intersections.h"
#include "tasks/boundary_kind.h"
#include "tasks/boundary_task.h"

namespace edgegrad {
namespace {

// Samples per pixel and sample of the picture, and pieces of lines with cells of directions by sample.
constexpr double kIntersectionShare = 0.5, kConeShare = 0.25, kOutlineShare = 0.1, kDirectionSegments = 0.03;
// Pieces of a curve about a light; share of the samples that goes to light seen by way of other surfaces.
constexpr int kTurnSegments = 64;
constexpr double kChainedShare = 0.4;

// Lines that hide something over all directions; of paths longer than `direct` chains of surfaces show it,
// too.
void add_lines(const SceneView& scene, const EdgeList& edges, const RenderOptions& options, BoundaryKind kind,
               Intersections found, int direct, Decisions& decided, std::vector<CurveTerm>& out) {
    if (!decided.found(kPartOf[kind], edges.tables, found)) return;
    auto lines = std::make_shared<EdgesAndIntersections>(edges.tables, std::move(found));
    const double picture = static_cast<double>(scene.camera.width) * scene.camera.height * options.samples;
    const double pieces = kDirectionSegments * kIntersectionShare * picture;
    Candidates candidates = over_directions(lines->intersections(), pieces, options.max_depth > direct);
    out.push_back({kind, std::move(candidates), std::move(lines), kIntersectionShare});
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
    // Held light moves over all of them (scene/contact.h). Else a camera that moves alone moves none of them
    // over what they are cut out of.
    const bool held = scene.mesh_contact || forced;
    RequestedMotion moving = motion;
    moving.camera = held, moving.lights |= forced;
    Intersections intersections;
    if ((meshes || held) && (surfaces || (lights && scene.lights.face_light)))
        intersections = seen && !scene.rays_differ && !forced
                            ? moving_intersections(edges.tables, moving, *seen)
                            : find_intersections(edges, moving, kScatteredRays | 1 << kShadowRay);
    if (lights)
        add_lines(scene, edges, options, kLightIntersection,
                  find_light_intersections(edges.tables, moving, intersections, scene.lights.face_light,
                                           edges.threads),
                  2, decided, out);
    if (surfaces)
        add_lines(scene, edges, options, kSurfaceIntersection, std::move(intersections), 3, decided, out);
}

// The same of disks, which turn with what they light: anything that moves moves them against surfaces.
void add_disk_intersections(const SceneView& scene, const EdgeList& edges, const RenderOptions& options,
                            Decisions& decided, std::vector<CurveTerm>& out) {
    if (!decided.computes(Part::kDiskIntersections)) return;
    add_lines(scene, edges, options, kDiskIntersection, find_disk_intersections(edges.tables, edges.threads),
              2, decided, out);
}

// The curve about a light, cut into pieces.
void add_turns(int32_t cell, double mass, Candidates& out) {
    for (int k = 0; k < kTurnSegments; ++k) {
        out.edge.push_back(0);
        out.cell.push_back(cell);
        out.u0.push_back(static_cast<float>(k) / kTurnSegments);
        out.u1.push_back(static_cast<float>(k + 1) / kTurnSegments);
        out.cumulative.push_back(out.mass() + mass);
    }
}

void add_cones(const SceneView& scene, const EdgeList& edges, const RenderOptions& options,
               Decisions& decided, std::vector<CurveTerm>& out) {
    if (!decided.computes(Part::kConeBorders)) return;
    Candidates cones;
    for (int chained = 0; chained < (options.max_depth > 2 ? 2 : 1); ++chained) {
        const double share = options.max_depth > 2 ? (chained ? kChainedShare : 1.0 - kChainedShare) : 1.0;
        for (const int32_t row : hard_cones(edges.tables.lights))
            if (scene.lights.light_of_row[row] >= 0) add_turns(row | (chained ? kChained : 0), share, cones);
    }
    if (cones.size() == 0) return decided.none(Part::kConeBorders, Reason::kNoLight);
    out.push_back({kConeBorder, std::move(cones), nullptr, kConeShare});
}

void add_outlines(const SceneView& scene, const EdgeList& edges, Decisions& decided,
                  std::vector<CurveTerm>& out) {
    if (!decided.computes(Part::kLightOutlines)) return;
    const SceneTables::LightRows& lights = edges.tables.lights;
    Candidates outlines;
    const bool parallel = scene.camera.kind == kOrthographic;
    // Where all rays are parallel they see all of a sun, or none of it.
    const int32_t count = scene.lights.sized_count + (parallel ? 0 : scene.lights.sized_distant);
    for (int32_t k = 0; k < count; ++k) {
        const int32_t row = scene.lights.sized[k];
        const int32_t kind = lights.kind[static_cast<size_t>(row)];
        if (!(lights.visible_to[static_cast<size_t>(row)] & (1 << kCameraRay))) continue;
        // Rays from one point of a lens are parallel to each other, but not across the camera's plane, where
        // the origins are that the disks face.
        if (kind == kDiskLight && parallel && scene.camera.aperture_radius > 0.0f) continue;
        add_turns(row, 1.0, outlines);
        decided[Part::kLightOutlines].lights.push_back(row);
    }
    if (outlines.size() == 0) return decided.none(Part::kLightOutlines, Reason::kNoLight);
    out.push_back({kLightOutline, std::move(outlines), nullptr, kOutlineShare});
}

// What the camera sees of lights that meshes pass through.
void add_intersection_outlines(const SceneView& scene, const EdgeList& edges, const RequestedMotion& motion,
                               Decisions& decided, std::vector<CurveTerm>& out) {
    if (!decided.computes(Part::kIntersectionOutlines)) return;
    // Each of parallel rays has an origin of its own, which a disk would face.
    const bool disks = scene.camera.kind != kOrthographic;
    RequestedMotion moving = motion;
    moving.camera |= decided.forces(Part::kIntersectionOutlines);
    Intersections found = find_seen_lights(edges.tables, moving, disks, edges.threads);
    if (!decided.found(Part::kIntersectionOutlines, edges.tables, found)) return;
    auto lines = std::make_shared<EdgesAndIntersections>(edges.tables, std::move(found));
    Candidates candidates = lines->intersections();
    out.push_back({kIntersectionOutline, std::move(candidates), std::move(lines), kOutlineShare});
}

}  // namespace

std::vector<CurveTerm> curve_terms(const SceneView& scene, const EdgeList& edges,
                                   const RenderOptions& options, const RequestedMotion& motion,
                                   const Intersections* seen, Decisions& decided) {
    std::vector<CurveTerm> out;
    add_outlines(scene, edges, decided, out);
    add_intersection_outlines(scene, edges, motion, decided, out);
    add_intersections(scene, edges, options, motion, seen, decided, out);
    add_disk_intersections(scene, edges, options, decided, out);
    add_cones(scene, edges, options, decided, out);
    return out;
}

}  // namespace edgegrad
