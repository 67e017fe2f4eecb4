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
               Intersections found, int direct, std::vector<CurveTerm>& out) {
    if (found.size() == 0) return;
    auto lines = std::make_shared<EdgesAndIntersections>(edges.tables, std::move(found));
    const double picture = static_cast<double>(scene.camera.width) * scene.camera.height * options.samples;
    const double pieces = kDirectionSegments * kIntersectionShare * picture;
    Candidates candidates = over_directions(lines->intersections(), pieces, options.max_depth > direct);
    out.push_back({kind, std::move(candidates), std::move(lines), kIntersectionShare});
}

void add_intersections(const SceneView& scene, const EdgeList& edges, const RenderOptions& options,
                       const RequestedMotion& motion, const Intersections* seen,
                       std::vector<CurveTerm>& out) {
    const bool lights = options.shadow && scene.lights.count > 0;
    const bool surfaces = options.indirect && options.max_depth >= 3;
    const bool meshes = motion.any_mesh_moves();
    // Held light moves over all of them (scene/contact.h).
    const bool held = scene.mesh_contact;
    const bool turning = motion.camera && scene.lights.kinds >> kSphereLight & 1;
    if (!held && !(lights && (meshes || motion.lights || turning)) && !(surfaces && meshes)) return;
    // Else a camera that moves alone moves none of them over what they are cut out of.
    RequestedMotion moving = motion;
    moving.camera = held;
    Intersections intersections;
    if ((meshes || held) && (surfaces || (lights && scene.lights.face_light)))
        intersections = seen && !scene.rays_differ
                            ? moving_intersections(edges.tables, moving, *seen)
                            : find_intersections(edges, moving, kScatteredRays | 1 << kShadowRay);
    if (lights)
        add_lines(scene, edges, options, kLightIntersection,
                  find_light_intersections(edges.tables, moving, intersections, scene.lights.face_light,
                                           edges.threads),
                  2, out);
    if (surfaces) add_lines(scene, edges, options, kSurfaceIntersection, std::move(intersections), 3, out);
}

// The same of disks, which turn with what they light: anything that moves moves them against surfaces.
void add_disk_intersections(const SceneView& scene, const EdgeList& edges, const RenderOptions& options,
                            const RequestedMotion& motion, std::vector<CurveTerm>& out) {
    if (!options.shadow || !(scene.lights.kinds >> kDiskLight & 1)) return;
    if (!motion.camera && !motion.lights && !motion.any_mesh_moves()) return;
    add_lines(scene, edges, options, kDiskIntersection, find_disk_intersections(edges.tables, edges.threads),
              2, out);
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
               std::vector<CurveTerm>& out) {
    if (!options.shadow || scene.lights.count == 0) return;
    const SceneTables::LightRows& lights = edges.tables.lights;
    Candidates cones;
    for (int chained = 0; chained < (options.max_depth > 2 ? 2 : 1); ++chained) {
        const double share = options.max_depth > 2 ? (chained ? kChainedShare : 1.0 - kChainedShare) : 1.0;
        for (size_t row = 0; row < lights.kind.size(); ++row) {
            const float* params = &lights.params[kLightParams * row];
            const bool hard = (lights.flags[row] & (kLightCone | kLightLinearCone)) &&
                              params[kLightEdgeScale] >= 0.5f * kLightStep;
            if (!hard || scene.lights.light_of_row[row] < 0) continue;
            add_turns(static_cast<int32_t>(row) | (chained ? kChained : 0), share, cones);
        }
    }
    if (cones.size() > 0) out.push_back({kConeBorder, std::move(cones), nullptr, kConeShare});
}

void add_outlines(const SceneView& scene, const EdgeList& edges, const RenderOptions& options,
                  const RequestedMotion& motion, std::vector<CurveTerm>& out) {
    if (!options.primary || !(motion.camera || motion.lights)) return;
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
    }
    if (outlines.size() > 0) out.push_back({kLightOutline, std::move(outlines), nullptr, kOutlineShare});
}

// What the camera sees of lights that meshes pass through.
void add_intersection_outlines(const SceneView& scene, const EdgeList& edges, const RenderOptions& options,
                               const RequestedMotion& motion, std::vector<CurveTerm>& out) {
    if (!options.primary || scene.lights.sized_count == 0) return;
    // Each of parallel rays has an origin of its own, which a disk would face.
    const bool disks = scene.camera.kind != kOrthographic;
    Intersections found = find_seen_lights(edges.tables, motion, disks, edges.threads);
    if (found.size() == 0) return;
    auto lines = std::make_shared<EdgesAndIntersections>(edges.tables, std::move(found));
    Candidates candidates = lines->intersections();
    out.push_back({kIntersectionOutline, std::move(candidates), std::move(lines), kOutlineShare});
}

}  // namespace

std::vector<CurveTerm> curve_terms(const SceneView& scene, const EdgeList& edges,
                                   const RenderOptions& options, const RequestedMotion& motion,
                                   const Intersections* seen) {
    std::vector<CurveTerm> out;
    add_outlines(scene, edges, options, motion, out);
    add_intersection_outlines(scene, edges, options, motion, out);
    if (options.max_depth < 2) return out;
    add_intersections(scene, edges, options, motion, seen, out);
    add_disk_intersections(scene, edges, options, motion, out);
    add_cones(scene, edges, options, out);
    return out;
}

}  // namespace edgegrad
