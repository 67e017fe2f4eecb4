#include "engine/terms/edge_on_faces.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <tuple>
#include <utility>

#include "boundary/curves/mesh_intersections.h"
#include "boundary/curves/picture_frame.h"
#include "boundary/meshes/trees/face_tree.h"
#include "boundary/meshes/trees/placement.h"
#include "sampling/z_order.h"
#include "scene/mesh_instances.h"
#include "util/parallel.h"

namespace edgegrad {
namespace {

// Largest |cos| of the angle between normal and camera ray of an edge-on face. Samples by area per sample and
// pixel of the picture, for a face seen face-on. Larger values lower the variance for more samples.
constexpr double kEdgeOn = 0.15, kDensity = 0.3;
// Largest numbers of samples of one face and of all faces, relative to the picture's.
constexpr double kMostOfFace = 0.1, kMost = 0.25;
// Faces per item of parallel work.
constexpr int64_t kFaceBlock = 1 << 13;
// Largest number of faces of all instances that are examined, which limits seconds and memory.
constexpr int64_t kMostFaces = int64_t{1} << 22;
// Triangles are sorted by tiles, 2^8 along each side of the picture, so that systematic samples along the
// list are spread evenly over the picture.
constexpr uint32_t kTileBits = 8;

// The region that some pixel may see, extended by the filter and by depth of field: the intersection of half
// spaces, each given by a linear function that is at least zero.
class FramePlanes {
 public:
    explicit FramePlanes(const CameraView& c)
        : camera_(c),
          position_(vector_at(c.position)),
          right_(vector_at(c.right)),
          up_(vector_at(c.up)),
          back_(vector_at(c.back)),
          frame_(c) {}

    static constexpr int kCount = 6;
    using Polygon = std::array<Vector, 3 + kCount>;

    // Clips the triangle of the first three corners. Returns the number of corners of the result.
    int clip(Polygon& polygon) const {
        int count = 3;
        for (int plane = 0; plane < kCount && count >= 3; ++plane) {
            Polygon out;
            int kept = 0;
            for (int k = 0; k < count; ++k) {
                const Vector a = polygon[k], b = polygon[(k + 1) % count];
                const double u = value(plane, a), v = value(plane, b);
                if (u >= 0.0) out[kept++] = a;
                if ((u >= 0.0) != (v >= 0.0)) out[kept++] = a + (b - a) * (u / (u - v));
            }
            polygon = out;
            count = kept;
        }
        return count >= 3 ? count : 0;
    }

    Vector ray_through(Vector p) const { return frame_.ray_through(p); }
    double lens_reach() const { return frame_.lens_reach(); }
    // The tile of the picture that a point is in.
    uint32_t place_of(Vector point) const {
        const Vector p = point - position_;
        const double h = depth(p), down = -static_cast<double>(camera_.focal / camera_.pixel_aspect);
        return z_order((camera_.focal * dot(right_, p) / h + camera_.principal[0]) / camera_.width,
                       (down * dot(up_, p) / h + camera_.principal[1]) / camera_.height, kTileBits);
    }
    // The picture's area per area across the ray, pixels^2/m^2 (path/camera_projection.h, kappa |D|).
    double scale(Vector p) const {
        const double focal = camera_.focal, all = focal * focal / camera_.pixel_aspect;
        if (camera_.kind == kOrthographic) return all;
        const Vector d = p - position_;
        const double z = -dot(back_, d);
        return all * length(d) / (z * z * z);
    }

 private:
    // The divisor of the projection.
    double depth(Vector p) const {
        return camera_.kind == kOrthographic ? 1.0 : std::max(-dot(back_, p), 1e-12);
    }
    double value(int plane, Vector point) const {
        const CameraView& c = camera_;
        const Vector p = point - position_;
        const double z = -dot(back_, p);
        if (plane == 0) return z - c.clip_start;
        if (plane == 1) return c.clip_end - z;
        const double h = depth(p);
        const double focal = plane < 4 ? c.focal : -c.focal / c.pixel_aspect;
        const double place = focal * dot(plane < 4 ? right_ : up_, p) + c.principal[plane < 4 ? 0 : 1] * h;
        // A lens point shifts the picture by at most blur |z/F - 1| / h.
        const double blur =
            focal * c.aperture_radius / (plane < 4 ? std::max(1e-6f, c.aperture_ratio) : 1.0f);
        const double more = frame_.margin() * h + std::abs(blur) * (1.0 + z / c.focus_distance);
        return more + (plane % 2 == 0 ? place : (plane < 4 ? c.width : c.height) * h - place);
    }

    const CameraView& camera_;
    Vector position_, right_, up_, back_;
    PictureFrame frame_;
};

struct EdgeSegment {
    Vector corner[3];
    double mass;  // samples by area per sample of a pixel
};
// A face of an instance that is seen edge-on.
struct Entry {
    int32_t face, instance;
    int pieces;
    double mass, area;
    uint32_t place;
    const EdgeSegment* first;
};
struct Chunk {
    std::vector<Entry> entries;
    std::vector<EdgeSegment> pieces;
};

// Adds a face if the camera sees it edge-on.
void add_face(const FramePlanes& frame, const SceneView& scene, const Placement& place, int32_t face,
              int32_t instance, int8_t side, double most, Chunk& part) {
    FramePlanes::Polygon polygon;
    for (int k = 0; k < 3; ++k) polygon[k] = place(vertex(scene, scene.faces[3 * int64_t{face} + k]));
    const Vector m = cross(polygon[1] - polygon[0], polygon[2] - polygon[0]);
    const double size = length(m);
    // m . D is constant over the points D of the face. Use the nearest point of the lens.
    const double height = dot(m, frame.ray_through(polygon[0])), reach = frame.lens_reach() * size;
    if (!(size > 0.0) || side * height > reach) return;  // the back of a solid body
    const double nearest = std::max(0.0, std::abs(height) - reach) / (kEdgeOn * size);
    const auto edge_on = [&](Vector p) {
        const Vector d = frame.ray_through(p);
        return nearest * nearest <= dot(d, d);
    };
    bool any = false;
    for (int k = 0; k < 3; ++k) any |= edge_on(polygon[k]);
    if (!any) return;
    const int corners = frame.clip(polygon);
    if (corners == 0) return;
    for (int k = 0; k < corners; ++k)
        if (!edge_on(polygon[k])) return;
    Entry entry{face, instance, 0, 0.0, 0.0, frame.place_of(polygon[0]), nullptr};
    for (int k = 2; k < corners; ++k) {
        EdgeSegment piece{{polygon[0], polygon[k - 1], polygon[k]}, 0.0};
        piece.mass =
            0.5 * length(cross(piece.corner[1] - piece.corner[0], piece.corner[2] - piece.corner[0]));
        if (!(piece.mass > 0.0)) continue;
        part.pieces.push_back(piece);
        ++entry.pieces;
        entry.area += piece.mass;
        entry.mass +=
            piece.mass *
            (frame.scale(piece.corner[0]) + frame.scale(piece.corner[1]) + frame.scale(piece.corner[2])) /
            3.0;
    }
    if (entry.pieces == 0) return;
    entry.mass = std::min(kDensity * entry.mass, most);
    // Share the face's samples among its triangles by area.
    for (int k = 0; k < entry.pieces; ++k)
        part.pieces[part.pieces.size() - 1 - static_cast<size_t>(k)].mass *= entry.mass / entry.area;
    part.entries.push_back(entry);
}

// A range of faces of one mesh, placed by one instance.
struct Run {
    size_t mesh;
    int32_t instance;
    int8_t side;
    int64_t first, last;
};

// Keeps about kMostFaces faces: those of the instances that look largest from the camera. Faces that are not
// listed get the picture's own samples alone, so that any choice gives the same mean.
void keep_largest(std::vector<Run>& runs, const SceneTables& tables, const CameraView& camera) {
    std::vector<std::pair<float, size_t>> order;  // minus the size, and the run
    size_t boxed = tables.mesh_first_face.size();
    Box box;
    for (size_t k = 0; k < runs.size(); ++k) {
        const Run& run = runs[k];
        if (boxed != run.mesh) box = mesh_box(tables, boxed = run.mesh);
        const Box world = PlacedMesh(tables, static_cast<int32_t>(run.mesh), run.instance, box).box;
        float extent = 0.0f, distance = 0.0f;
        for (int c = 0; c < 3; ++c) {
            const float away = 0.5f * (world.low[c] + world.high[c]) - camera.position[c];
            extent = std::max(extent, world.high[c] - world.low[c]), distance += away * away;
        }
        order.emplace_back(-extent * extent / std::max(distance, 1e-30f), k);
    }
    std::sort(order.begin(), order.end());
    std::vector<Run> kept;
    int64_t faces = 0;
    for (const auto& [size, k] : order) {
        if (faces > kMostFaces) break;
        kept.push_back(runs[k]);
        faces += runs[k].last - runs[k].first;
    }
    runs = std::move(kept);
}

// The ranges of faces to examine.
std::vector<Run> examined(const SceneView& scene, const SceneTables& tables, const std::vector<int8_t>& sides,
                          const RequestedMotion& motion) {
    const auto instances = mesh_instances(tables);
    std::vector<Run> runs;
    int64_t faces = 0;
    for (size_t mesh = 0; mesh < instances.size(); ++mesh) {
        const bool moves =
            motion.camera || motion.moving[mesh] || (motion.instances && is_placed(instances[mesh]));
        if (!moves || !(tables.mesh_mask[mesh] & (1 << kCameraRay))) continue;
        const int64_t end = tables.mesh_first_face[mesh + 1];
        for (int32_t instance : instances[mesh])
            for (int64_t first = tables.mesh_first_face[mesh]; first < end; first += kFaceBlock) {
                runs.push_back({mesh, instance, sides[mesh], first, std::min(first + kFaceBlock, end)});
                faces += runs.back().last - first;
            }
    }
    if (faces > kMostFaces) keep_largest(runs, tables, scene.camera);
    return runs;
}

double pixels_of(const CameraView& camera) { return static_cast<double>(camera.width) * camera.height; }

// Adds the faces of a range that the camera sees edge-on, until done(part).
template <typename Done>
void add_run(const FramePlanes& frame, const SceneView& scene, const Run& run, Chunk& part,
             const Done& done) {
    const Placement place = Placement::of(scene, run.instance);
    const double most = kMostOfFace * pixels_of(scene.camera);
    for (int64_t face = run.first; face < run.last && !done(part); ++face)
        add_face(frame, scene, place, static_cast<int32_t>(face), run.instance, run.side, most, part);
}

}  // namespace

bool edge_on_matters(const SceneView& scene, const RenderOptions& options) {
    return !is_panorama(scene.camera.kind) &&
           (scene.lights.count > 0 || options.max_depth > 2 || scene.corner_normal ||
            scene.textures.closure_program || scene.textures.closure_weight_program ||
            (scene.all_flags & kHasNormalMap));
}

bool any_edge_on_face(const SceneView& scene, const SceneTables& tables, const std::vector<int8_t>& sides,
                      const RequestedMotion& motion, int threads) {
    const std::vector<Run> runs = examined(scene, tables, sides, motion);
    const FramePlanes frame(scene.camera);
    std::atomic<bool> found = false;
    parallel_for(threads, static_cast<int64_t>(runs.size()), nullptr, [&](int, int64_t k) {
        Chunk part;
        const auto done = [&](const Chunk& p) {
            if (!p.entries.empty()) found = true;
            return found.load();
        };
        add_run(frame, scene, runs[static_cast<size_t>(k)], part, done);
        done(part);
    });
    return found;
}

EdgeOnList edge_on_faces(const SceneView& scene, const SceneTables& tables, const std::vector<int8_t>& sides,
                         const RenderOptions& options, const RequestedMotion& motion, int threads) {
    EdgeOnList out;
    if (!edge_on_matters(scene, options)) return out;
    const std::vector<Run> runs = examined(scene, tables, sides, motion);
    const FramePlanes frame(scene.camera);
    const double pixels = pixels_of(scene.camera);
    std::vector<Chunk> parts(runs.size());
    parallel_for(threads, static_cast<int64_t>(runs.size()), nullptr, [&](int, int64_t k) {
        const auto at = static_cast<size_t>(k);
        add_run(frame, scene, runs[at], parts[at], [](const Chunk&) { return false; });
    });
    std::vector<Entry> entries;
    out.cumulative.push_back(0.0);
    for (const Chunk& part : parts) {
        const EdgeSegment* piece = part.pieces.data();
        for (const Entry& entry : part.entries) {
            entries.push_back(entry);
            entries.back().first = piece;
            piece += entry.pieces;
        }
    }
    std::stable_sort(entries.begin(), entries.end(),
                     [](const Entry& a, const Entry& b) { return a.place < b.place; });
    for (const Entry& entry : entries) {
        for (int k = 0; k < entry.pieces; ++k) {
            const EdgeSegment& piece = entry.first[k];
            out.segment_face.push_back(entry.face);
            out.segment_instance.push_back(entry.instance);
            for (const Vector& p : piece.corner)
                for (double x : {p.x, p.y, p.z}) out.corners.push_back(static_cast<float>(x));
            out.cumulative.push_back(out.cumulative.back() + piece.mass);
        }
    }
    const double mass = out.cumulative.back();
    if (!(mass > 0.0)) return out;
    out.total = static_cast<int64_t>(std::ceil(std::min(mass, kMost * pixels) * options.samples));
    std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
        return std::tie(a.face, a.instance) < std::tie(b.face, b.instance);
    });
    out.face_first.assign(tables.face_material.size() + 1, 0);
    for (const Entry& entry : entries) {
        ++out.face_first[static_cast<size_t>(entry.face) + 1];
        out.entry_instance.push_back(entry.instance);
        out.entry_density.push_back(
            static_cast<float>(entry.mass / entry.area * (static_cast<double>(out.total) / mass)));
    }
    for (size_t face = 1; face < out.face_first.size(); ++face)
        out.face_first[face] += out.face_first[face - 1];
    return out;
}

}  // namespace edgegrad
