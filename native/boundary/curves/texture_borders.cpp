#include "boundary/curves/texture_borders.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "boundary/meshes/seams.h"
#include "boundary/meshes/trees/placement.h"
#include "scene/mesh_edges.h"
#include "scene/mesh_instances.h"
#include "tasks/edge_weight_task.h"
#include "util/parallel.h"

namespace edgegrad {
namespace {

// A coordinate of a grid at the corners of a face. Differences up to `rounding` do not count, so that a
// border along an edge is not within the face.
struct Corners {
    std::array<double, 3> at;
    double rounding;

    double low() const { return std::min({at[0], at[1], at[2]}) + rounding; }
    double high() const { return std::max({at[0], at[1], at[2]}) - rounding; }
};
// The rounding of a coordinate relative to what it is the sum of.
constexpr double kRounding = 1e-5;

// Calls visit(corners) for each coordinate of the grids that varies over the face.
template <typename Visit>
void visit_coordinates(const TextureJumps& jumps, const TextureTables& t, int32_t face, const Visit& visit) {
    const size_t meshes = t.mesh_extent.size() / kMeshExtent,
                 mesh = static_cast<size_t>(t.face_mesh[static_cast<size_t>(face)]);
    for (const CellGrid& grid : jumps.grids) {
        const TextureAttribute& a = t.mesh_attributes[static_cast<size_t>(grid.attribute) * meshes + mesh];
        if (a.components <= 0) continue;  // one value for all corners, or none
        const float* values = t.attributes.data() + a.offset + 3 * int64_t{face} * a.components;
        for (const float* row : grid.row) {
            Corners found{};
            double size = 0.0;
            for (int corner = 0; corner < 3; ++corner) {
                double sum = row[3], parts = std::abs(sum);
                for (int k = 0; k < 3; ++k) {
                    const int component = a.components == 1 ? 0 : k;
                    if (component >= a.components) continue;
                    const double part =
                        static_cast<double>(row[k]) * values[corner * a.components + component];
                    sum += part, parts += std::abs(part);
                }
                found.at[static_cast<size_t>(corner)] = sum;
                size = std::max(size, parts);
            }
            found.rounding = kRounding * size;
            if (found.high() > found.low()) visit(found);
        }
    }
}

// The number of borders strictly within a face.
int64_t borders_within(const Corners& c) {
    return std::max<int64_t>(0, std::llround(std::ceil(c.high()) - std::floor(c.low())) - 1);
}

// The barycentrics at which the coordinate is `border` on the sides of the face.
bool ends_of(const Corners& c, double border, std::array<double, 3> (&ends)[2]) {
    int found = 0;
    for (size_t k = 0; k < 3 && found < 2; ++k) {
        const size_t next = (k + 1) % 3;
        if ((c.at[k] < border) == (c.at[next] < border)) continue;
        const double u = (border - c.at[k]) / (c.at[next] - c.at[k]);
        ends[found] = {0.0, 0.0, 0.0};
        ends[found][k] = 1.0 - u, ends[found][next] = u;
        ++found;
    }
    return found == 2;
}

Vector corner_of(const SceneTables& t, int32_t face, size_t corner) {
    return vector_at(&t.vertices[3 * static_cast<size_t>(t.faces[3 * static_cast<size_t>(face) + corner])]);
}

// Adds the borders strictly within a face.
void add_within(const SceneTables& t, int32_t face, const Corners& at, const Placement& placed,
                int32_t instance, Intersections& out) {
    if (borders_within(at) > kMostFaceBorders) return;
    for (double border = std::floor(at.low()) + 1.0; border < at.high(); border += 1.0) {
        std::array<double, 3> ends[2];
        if (!ends_of(at, border, ends)) continue;
        Vector line[2];
        for (int e = 0; e < 2; ++e) {
            line[e] = {0.0, 0.0, 0.0};
            for (size_t k = 0; k < 3; ++k) line[e] = line[e] + corner_of(t, face, k) * ends[e][k];
            line[e] = placed(line[e]);
        }
        const IntersectedFace one{static_cast<uint32_t>(face), instance};
        out.add(line, one, one);
    }
}

// Whether an edge lies along a border between two faces of one plane across which the texture continues.
// Such an edge is no candidate: else nothing jumps there.
bool follows_border(const EdgeList& edges, const MaterialJumps& jumps, int64_t edge) {
    const SceneTables& t = edges.tables;
    const auto e = static_cast<size_t>(edge);
    const uint32_t first = t.edge_face_first[e];
    if (t.edge_face_first[e + 1] - first != 2) return false;
    const uint32_t one = t.edge_faces[first], other = t.edge_faces[first + 1];
    const auto material = static_cast<size_t>(t.face_material[one]);
    if (!jumps.any[material] || t.face_material[one] != t.face_material[other]) return false;
    const float *n = edges.normal + 3 * size_t{one}, *m = edges.normal + 3 * size_t{other};
    if (!(dot(vector_at(n), vector_at(m)) > 0.0) ||
        length(cross(vector_at(n), vector_at(m))) >= static_cast<double>(kCoplanar))
        return false;
    bool along = false;
    visit_coordinates(jumps.of[material], t.textures, static_cast<int32_t>(one), [&](const Corners& at) {
        std::array<double, 2> ends{};
        size_t found = 0;
        for (size_t k = 0; k < 3; ++k) {
            const auto v = static_cast<uint32_t>(t.faces[3 * size_t{one} + k]);
            if (found < 2 && (v == t.edge_vertices[2 * e] || v == t.edge_vertices[2 * e + 1]))
                ends[found++] = at.at[k];
        }
        const double border = std::round(ends[0]);
        const bool here = found == 2 && std::abs(ends[0] - border) < at.rounding &&
                          std::abs(ends[1] - border) < at.rounding;
        along |= here;
    });
    return along && !is_seam(t, edge);
}

JumpingMeshes find_jumping_meshes(const SceneTables& tables, const MaterialJumps& jumps,
                                  const RequestedMotion& motion) {
    JumpingMeshes out;
    if (jumps.any.empty()) return out;
    const std::vector<uint8_t> moves = moving_surfaces(tables, motion);
    const auto instances = mesh_instances(tables);
    int64_t all = 0;
    for (int32_t mesh = 0; mesh < tables.visible_meshes; ++mesh) {
        const auto m = static_cast<size_t>(mesh);
        if (!(motion.camera || moves[m]) || !(tables.mesh_mask[m] & (1 << kCameraRay))) continue;
        bool sampled = false, left_out = false;
        int64_t borders = 0;
        for (int32_t face = tables.mesh_first_face[m]; face < tables.mesh_first_face[m + 1]; ++face) {
            const auto material = static_cast<size_t>(tables.face_material[static_cast<size_t>(face)]);
            if (!jumps.any[material]) continue;
            left_out |= jumps.of[material].elsewhere || mesh >= tables.first_field();
            if (mesh >= tables.first_field()) break;
            visit_coordinates(jumps.of[material], tables.textures, face, [&](const Corners& at) {
                const int64_t count = borders_within(at);
                left_out |= count > kMostFaceBorders;
                if (count <= kMostFaceBorders) borders += count, sampled = true;
            });
        }
        borders *= static_cast<int64_t>(instances[m].size());
        if (sampled && all + borders > kMostBorders) sampled = false, left_out = true;
        if (sampled) all += borders, out.sampled.push_back(mesh);
        if (left_out) out.left_out.push_back(mesh);
    }
    return out;
}

}  // namespace

std::shared_ptr<const MaterialJumps> kept_jumps(const SceneTables& tables, EdgeCache& kept) {
    return kept.jumps.get(true, [&] { return material_jumps(tables); });
}

std::shared_ptr<const JumpingMeshes> jumping_meshes(const SceneTables& tables, const RequestedMotion& motion,
                                                    EdgeCache& kept) {
    return kept.jumping_meshes.get(
        motion, [&] { return find_jumping_meshes(tables, *kept_jumps(tables, kept), motion); });
}

Intersections texture_borders(const EdgeList& edges, const std::vector<int32_t>& meshes) {
    const SceneTables& t = edges.tables;
    const auto kept = kept_jumps(t, edges.kept);
    const MaterialJumps& jumps = *kept;
    const auto instances = mesh_instances(t);
    Intersections out;
    if (jumps.any.empty()) return out;
    for (const int32_t mesh : meshes) {
        const auto m = static_cast<size_t>(mesh);
        const auto [first_edge, last_edge] = mesh_edges(t, m);
        for (const int32_t instance : instances[m]) {
            may_cancel();
            const Placement placed = Placement::of(t, instance);
            for (int32_t face = t.mesh_first_face[m]; face < t.mesh_first_face[m + 1]; ++face)
                visit_coordinates(jumps.of[static_cast<size_t>(t.face_material[static_cast<size_t>(face)])],
                                  t.textures, face,
                                  [&](const Corners& at) { add_within(t, face, at, placed, instance, out); });
            for (int64_t edge = first_edge; edge < last_edge; ++edge) {
                const auto e = static_cast<size_t>(edge);
                if (!follows_border(edges, jumps, edge)) continue;
                const uint32_t face = t.edge_faces[t.edge_face_first[e]];
                const Vector line[2] = {
                    placed(vector_at(&t.vertices[3 * static_cast<size_t>(t.edge_vertices[2 * e])])),
                    placed(vector_at(&t.vertices[3 * static_cast<size_t>(t.edge_vertices[2 * e + 1])]))};
                out.add(line, {face, instance}, {face, instance});
            }
        }
    }
    return out;
}

}  // namespace edgegrad
