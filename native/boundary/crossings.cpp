#include "boundary/crossings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "boundary/face_tree.h"
#include "boundary/picture_frame.h"
#include "parallel.h"
#include "scene/light_params.h"
#include "scene/mesh_instances.h"
#include "scene/vector.h"

namespace edgegrad {
namespace {

// Nearer to a plane than this, relative to the coordinates, is on it.
constexpr double kOnPlane = 1e-6;
// Sine squared of the least angle between two faces.
constexpr double kParallel = 1e-6;

struct Triangle3 {
    std::array<Vector, 3> p;
    Vector normal;  // of length |M|
    double size;    // largest coordinate

    Triangle3(const SceneTables& t, int32_t face) : size(0.0) {
        for (size_t k = 0; k < 3; ++k) {
            const float* v = corner(t, face, k);
            p[k] = {v[0], v[1], v[2]};
            size = std::max({size, std::abs(p[k].x), std::abs(p[k].y), std::abs(p[k].z)});
        }
        normal = cross(p[1] - p[0], p[2] - p[0]);
    }
    Triangle3(Vector p0, Vector p1, Vector p2) : p{p0, p1, p2}, normal(cross(p1 - p0, p2 - p0)), size(0.0) {
        for (const Vector& v : p) size = std::max({size, std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    }
};

// The part of `t` that lies in the plane of `other`; false if it has none, or an edge of it does.
bool cut(const Triangle3& t, const Triangle3& other, Vector (&ends)[2]) {
    const double tolerance = kOnPlane * std::max(t.size, other.size) * length(other.normal);
    double height[3];
    int on = 0;
    for (size_t k = 0; k < 3; ++k) {
        height[k] = dot(other.normal, t.p[k] - other.p[0]);
        on += std::abs(height[k]) <= tolerance;
    }
    if (on >= 2) return false;
    int found = 0;
    for (size_t k = 0; k < 3 && found < 2; ++k) {
        const size_t next = (k + 1) % 3;
        if ((height[k] < 0.0) == (height[next] < 0.0)) continue;
        ends[found++] = t.p[k] + (t.p[next] - t.p[k]) * (height[k] / (height[k] - height[next]));
    }
    return found == 2;
}

// The line that two triangles share; false if there is none.
bool shared_line(const SceneTables& tables, int32_t face, int32_t other, Vector (&ends)[2]) {
    const Triangle3 s(tables, face), t(tables, other);
    const Vector along = cross(s.normal, t.normal);
    const double sine2 = dot(along, along), scale2 = dot(s.normal, s.normal) * dot(t.normal, t.normal);
    if (!(sine2 > kParallel * scale2)) return false;
    Vector a[2], b[2];
    if (!cut(s, t, a) || !cut(t, s, b)) return false;
    // Both lie on one line: what they have in common is between the second and the third of the four ends.
    if (dot(along, a[0]) > dot(along, a[1])) std::swap(a[0], a[1]);
    if (dot(along, b[0]) > dot(along, b[1])) std::swap(b[0], b[1]);
    ends[0] = dot(along, a[0]) > dot(along, b[0]) ? a[0] : b[0];
    ends[1] = dot(along, a[1]) < dot(along, b[1]) ? a[1] : b[1];
    return dot(along, ends[1] - ends[0]) > 0.0 &&
           length(ends[1] - ends[0]) > kOnPlane * std::max(s.size, t.size);
}

// A rectangle or ellipse of the light table.
struct FlatLight {
    Vector center, x, y;  // half axes
    bool ellipse;
    Box box;

    FlatLight(const float* row, bool is_ellipse) : ellipse(is_ellipse) {
        const auto vector = [&](int at) { return Vector{row[at], row[at + 1], row[at + 2]}; };
        center = vector(kLightPosition);
        x = vector(kLightAxisX) * static_cast<double>(row[kLightExtentX]);
        y = vector(kLightAxisY) * static_cast<double>(row[kLightExtentY]);
        for (double s : {-1.0, 1.0})
            for (double t : {-1.0, 1.0}) {
                const Vector p = center + x * s + y * t;
                const float corner[3] = {static_cast<float>(p.x), static_cast<float>(p.y),
                                         static_cast<float>(p.z)};
                box.add(corner);
            }
    }

    // The line along which a triangle cuts the light; false if there is none, or an edge of it lies in the
    // light's plane.
    bool cut_by(const Triangle3& t, Vector (&ends)[2]) const {
        const Vector normal = cross(x, y), along = cross(t.normal, normal);
        const double scale2 = dot(t.normal, t.normal) * dot(normal, normal);
        if (!(dot(along, along) > kParallel * scale2)) return false;
        if (!cut(t, Triangle3(center, center + x, center + y), ends)) return false;
        // The part of it where the light is: of a + b k, k from 0 to 1, in the frame of the half axes.
        const auto place = [&](const Vector& p, const Vector& axis) {
            return dot(p - center, axis) / dot(axis, axis);
        };
        const double a[2] = {place(ends[0], x), place(ends[0], y)};
        const double b[2] = {place(ends[1], x) - a[0], place(ends[1], y) - a[1]};
        double low = 0.0, high = 1.0;
        if (ellipse) {
            const double bb = b[0] * b[0] + b[1] * b[1], ab = a[0] * b[0] + a[1] * b[1];
            const double root = ab * ab - bb * (a[0] * a[0] + a[1] * a[1] - 1.0);
            if (!(root > 0.0)) return false;
            low = std::max(low, (-ab - std::sqrt(root)) / bb);
            high = std::min(high, (-ab + std::sqrt(root)) / bb);
        } else {
            for (int c = 0; c < 2; ++c) {
                if (b[c] == 0.0) {
                    if (std::abs(a[c]) >= 1.0) return false;
                    continue;
                }
                const double one = (-1.0 - a[c]) / b[c], other = (1.0 - a[c]) / b[c];
                low = std::max(low, std::min(one, other));
                high = std::min(high, std::max(one, other));
            }
        }
        if (!(high > low)) return false;
        const Vector first = ends[0], way = ends[1] - ends[0];
        ends[0] = first + way * low;
        ends[1] = first + way * high;
        return length(ends[1] - ends[0]) > kOnPlane * t.size;
    }
};

// Whether two faces have a corner in common (by place: copies of a vertex count as one).
bool neighbours(const SceneTables& t, int32_t face, int32_t other) {
    const int32_t* f = &t.faces[3 * static_cast<size_t>(face)];
    const int32_t* g = &t.faces[3 * static_cast<size_t>(other)];
    for (int k = 0; k < 3; ++k)
        if (f[k] == g[0] || f[k] == g[1] || f[k] == g[2]) return true;
    for (size_t j = 0; j < 3; ++j)
        for (size_t k = 0; k < 3; ++k) {
            const float *p = corner(t, face, j), *q = corner(t, other, k);
            const float scale = std::max({std::abs(p[0]), std::abs(p[1]), std::abs(p[2])});
            const float d[3] = {p[0] - q[0], p[1] - q[1], p[2] - q[2]};
            if (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] <= 1e-12f * scale * scale) return true;
        }
    return false;
}

std::vector<int32_t> faces_in(const SceneTables& t, int32_t mesh, const Box& box, int threads) {
    constexpr int32_t kBlock = 1 << 14;
    const int32_t begin = t.mesh_first_face[static_cast<size_t>(mesh)];
    const int32_t end = t.mesh_first_face[static_cast<size_t>(mesh) + 1];
    std::vector<std::vector<int32_t>> parts(static_cast<size_t>((end - begin + kBlock - 1) / kBlock));
    parallel_for(threads, static_cast<int64_t>(parts.size()), nullptr, [&](int, int64_t part) {
        const int32_t first = begin + static_cast<int32_t>(part) * kBlock;
        for (int32_t f = first; f < std::min(end, first + kBlock); ++f)
            if (box_of(t, f).meets(box)) parts[static_cast<size_t>(part)].push_back(f);
    });
    std::vector<int32_t> faces;
    for (const auto& part : parts) faces.insert(faces.end(), part.begin(), part.end());
    return faces;
}

void add_pair(const SceneTables& tables, int32_t face, int32_t other, Crossings& out) {
    Vector ends[2];
    if (!shared_line(tables, face, other, ends)) return;
    for (const Vector& e : ends)
        for (double x : {e.x, e.y, e.z}) out.ends.push_back(static_cast<float>(x));
    out.faces.push_back(static_cast<uint32_t>(face));
    out.faces.push_back(static_cast<uint32_t>(other));
}

void join(const std::vector<Crossings>& parts, Crossings& out) {
    for (const Crossings& part : parts) {
        out.ends.insert(out.ends.end(), part.ends.begin(), part.ends.end());
        out.faces.insert(out.faces.end(), part.faces.begin(), part.faces.end());
    }
}

void search_pair(const SceneTables& tables, int32_t one, int32_t other, const Box& common, int threads,
                 Crossings& out) {
    std::vector<int32_t> few = faces_in(tables, one, common, threads);
    if (few.empty()) return;
    std::vector<int32_t> many = faces_in(tables, other, common, threads);
    if (few.size() > many.size()) std::swap(few, many);
    if (few.empty()) return;
    const FaceTree tree(tables, std::move(many), threads);
    constexpr size_t kBlock = 256;
    std::vector<Crossings> parts((few.size() + kBlock - 1) / kBlock);
    parallel_for(threads, static_cast<int64_t>(parts.size()), nullptr, [&](int, int64_t part) {
        const size_t first = static_cast<size_t>(part) * kBlock;
        for (size_t k = first; k < std::min(few.size(), first + kBlock); ++k)
            tree.visit(box_of(tables, few[k]),
                       [&](int32_t f) { add_pair(tables, few[k], f, parts[static_cast<size_t>(part)]); });
    });
    join(parts, out);
}

void search_self(const SceneTables& tables, int32_t mesh, int threads, Crossings& out) {
    std::vector<int32_t> faces(static_cast<size_t>(tables.mesh_first_face[static_cast<size_t>(mesh) + 1] -
                                                   tables.mesh_first_face[static_cast<size_t>(mesh)]));
    std::iota(faces.begin(), faces.end(), tables.mesh_first_face[static_cast<size_t>(mesh)]);
    const FaceTree tree(tables, std::move(faces), threads);
    const std::vector<FaceTree::Pair> pairs = tree.pairs(256);
    std::vector<Crossings> parts(pairs.size());
    parallel_for(threads, static_cast<int64_t>(parts.size()), nullptr, [&](int, int64_t k) {
        const auto part = static_cast<size_t>(k);
        tree.visit_pairs(pairs[part], [&](int32_t face, int32_t other) {
            if (!neighbours(tables, face, other)) add_pair(tables, face, other, parts[part]);
        });
    });
    join(parts, out);
}

}  // namespace

Crossings find_crossings(const SceneTables& tables, const Asked& asked, int32_t seers, int threads) {
    const auto meshes = static_cast<size_t>(tables.visible_meshes);
    std::vector<Box> boxes(meshes);
    std::vector<uint8_t> seen(meshes);
    const auto instances = mesh_instances(tables);
    for (size_t m = 0; m < meshes; ++m) {
        seen[m] = !is_placed(instances[m]) && (tables.mesh_mask[m] & seers);
        if (seen[m]) boxes[m] = mesh_box(tables, m);
    }
    Crossings out;
    for (size_t a = 0; a < meshes; ++a) {
        for (size_t b = a; b < meshes; ++b) {
            if (!seen[a] || !seen[b] || !boxes[a].meets(boxes[b])) continue;
            if (!asked.camera && !asked.moving[a] && !asked.moving[b]) continue;
            if (a == b) {
                const bool small =
                    tables.mesh_first_face[a + 1] - tables.mesh_first_face[a] <= kSelfCrossingFaces;
                if (small) search_self(tables, static_cast<int32_t>(a), threads, out);
                continue;
            }
            Box common;
            for (int c = 0; c < 3; ++c) {
                common.low[c] = std::max(boxes[a].low[c], boxes[b].low[c]);
                common.high[c] = std::min(boxes[a].high[c], boxes[b].high[c]);
            }
            search_pair(tables, static_cast<int32_t>(a), static_cast<int32_t>(b), common, threads, out);
        }
    }
    return out;
}

Crossings moving_crossings(const SceneTables& tables, const Asked& asked, const Crossings& all) {
    if (asked.camera) return all;
    const auto moves = [&](uint32_t face) {
        const auto& first = tables.mesh_first_face;
        const auto next = std::upper_bound(first.begin(), first.end(), static_cast<int32_t>(face));
        return asked.moving[static_cast<size_t>(next - first.begin() - 1)] != 0;
    };
    Crossings out;
    for (size_t k = 0; k < static_cast<size_t>(all.size()); ++k)
        if (moves(all.faces[2 * k]) || moves(all.faces[2 * k + 1])) out.add(all, k);
    return out;
}

Crossings find_pierced_lights(const SceneTables& tables, const Asked& asked, const Crossings& crossings,
                              const int32_t* emissive, int threads) {
    Crossings out;
    for (size_t k = 0; k < static_cast<size_t>(crossings.size()) && emissive; ++k) {
        const uint32_t* faces = &crossings.faces[2 * k];
        if (emissive[faces[0]] < 0 && emissive[faces[1]] < 0) continue;
        out.add(crossings, k);
    }
    const auto instances = mesh_instances(tables);
    for (size_t row = 0; row < tables.lights.kind.size(); ++row) {
        const int32_t kind = tables.lights.kind[row];
        if (kind != kRectangleLight && kind != kEllipseLight) continue;
        const FlatLight light(&tables.lights.params[kLightParams * row], kind == kEllipseLight);
        for (size_t mesh = 0; mesh < instances.size(); ++mesh) {
            if (is_placed(instances[mesh]) || !(asked.lights || asked.moving[mesh])) continue;
            for (int32_t face : faces_in(tables, static_cast<int32_t>(mesh), light.box, threads)) {
                Vector ends[2];
                if (!light.cut_by(Triangle3(tables, face), ends)) continue;
                for (const Vector& e : ends)
                    for (double x : {e.x, e.y, e.z}) out.ends.push_back(static_cast<float>(x));
                out.faces.push_back(static_cast<uint32_t>(face));
                out.faces.push_back(kLightOfTable | static_cast<uint32_t>(row));
            }
        }
    }
    return out;
}

EdgesAndCrossings::EdgesAndCrossings(const SceneTables& tables, Crossings crossings)
    : edge_count_(static_cast<int32_t>(tables.edge_vertices.size() / 2)), crossings_(std::move(crossings)) {
    if (crossings_.size() == 0) return;
    face_first_ = tables.edge_face_first;
    faces_ = tables.edge_faces;
    faces_.insert(faces_.end(), crossings_.faces.begin(), crossings_.faces.end());
    for (int64_t k = 0; k < crossings_.size(); ++k) face_first_.push_back(face_first_.back() + 2);
}

SceneView EdgesAndCrossings::view(SceneView scene) const {
    if (crossings_.size() == 0) return scene;
    scene.edge_face_first = face_first_.data();
    scene.edge_faces = faces_.data();
    scene.crossing_ends = crossings_.ends.data();
    return scene;
}

Candidates EdgesAndCrossings::crossings() const {
    Candidates out;
    for (int64_t k = 0; k < crossings_.size(); ++k) {
        const float* p = &crossings_.ends[6 * static_cast<size_t>(k)];
        out.edge.push_back(edge_count_ + static_cast<int32_t>(k));
        out.u0.push_back(0.0f);
        out.u1.push_back(1.0f);
        out.cumulative.push_back(out.mass() + length(Vector{p[3], p[4], p[5]} - Vector{p[0], p[1], p[2]}));
    }
    return out;
}

void EdgesAndCrossings::add_candidates(const CameraView& camera, Candidates& candidates) const {
    const PictureFrame frame(camera);
    for (int64_t k = 0; k < crossings_.size(); ++k) {
        const float* p = &crossings_.ends[6 * static_cast<size_t>(k)];
        frame.pieces({p[0], p[1], p[2]}, {p[3], p[4], p[5]}, [&](const PictureFrame::Piece& piece) {
            if (!(piece.pixels > 0.0)) return;
            candidates.instance.resize(candidates.edge.size(), -1);
            candidates.edge.push_back(edge_count_ + static_cast<int32_t>(k));
            candidates.instance.push_back(-1);
            candidates.u0.push_back(static_cast<float>(piece.u0));
            candidates.u1.push_back(static_cast<float>(piece.u1));
            candidates.cumulative.push_back(candidates.cumulative.back() + piece.pixels);
        });
    }
}

}  // namespace edgegrad
