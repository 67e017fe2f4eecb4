#include "boundary/candidates.h"

#include <algorithm>
#include <cmath>

#include "boundary/picture_frame.h"
#include "boundary/seams.h"
#include "kernels.h"
#include "parallel.h"

namespace edgegrad {
namespace {

using V = Vector;

V vertex(const SceneView& scene, int64_t k) {
    const float* p = scene.vertices + 3 * k;
    return {p[0], p[1], p[2]};
}
V vector(const float* p) { return {p[0], p[1], p[2]}; }

// Where an instance places the points of its mesh; without one they stay.
struct Placement {
    const float* matrix;  // rows of 4; null: none

    V operator()(V p) const {
        if (!matrix) return p;
        const auto row = [&](const float* m) {
            return m[0] * p.x + m[1] * p.y + m[2] * p.z + static_cast<double>(m[3]);
        };
        return {row(matrix), row(matrix + 4), row(matrix + 8)};
    }
};

// Faces whose normals differ by less than this sine lie in one plane.
constexpr double kCoplanar = 1e-6;
// Least share of a crease's length that is sampled, however blunt it is: the jump may come from
// shadows rather than from the angle. Lights without size draw these sharply.
constexpr double kLeastCrease = 0.005, kLeastSharp = 0.05;
// Share for edges inside or behind a solid body, which are hidden unless the mesh crosses itself.
constexpr double kHidden = 0.05;
// Cells of directions about an edge, most along each axis; share of the samples that goes to segments which
// the camera sees by way of other surfaces.
constexpr double kMostDirections = 16.0, kChainedShare = 0.4;
// Edges per item of parallel work.
constexpr int64_t kEdgeBlock = 1 << 13;

// The faces of an edge, for what its shape tells.
struct Wedge {
    int faces = 0;             // with an area
    V normal[2];               // unit normals of the first two as they are wound
    V third[2];                // their third corners, from the edge's first vertex
    bool same_surface = true;  // of one material, and no seam between them
    bool smooth = false;       // the first two have shading normals of their own at their corners

    // Two faces in one plane, of one orientation and one surface: nothing jumps there.
    bool flat() const {
        return faces == 2 && same_surface && dot(normal[0], normal[1]) > 0.0 &&
               length(cross(normal[0], normal[1])) < kCoplanar;
    }
};

V unit_normal(V p0, V p1, V p2) {
    const V m = cross(p1 - p0, p2 - p0);
    const double l = length(m);
    return l > 0.0 ? V{m.x / l, m.y / l, m.z / l} : V{0.0, 0.0, 0.0};
}

Wedge wedge_of(const SceneView& scene, const EdgeList& edges, int64_t edge,
               const Placement& place = {nullptr}) {
    Wedge wedge;
    const V a = place(vertex(scene, scene.edge_vertices[2 * edge]));
    const uint32_t first = scene.edge_face_first[edge], last = scene.edge_face_first[edge + 1];
    for (uint32_t k = first; k < last; ++k) {
        const uint32_t face = scene.edge_faces[k];
        const int32_t* f = scene.faces + 3 * static_cast<int64_t>(face);
        const V n = !place.matrix ? edges.normal[face]
                                  : unit_normal(place(vertex(scene, f[0])), place(vertex(scene, f[1])),
                                                place(vertex(scene, f[2])));
        if (dot(n, n) == 0.0) continue;  // no area, no border
        if (wedge.faces < 2) {
            wedge.normal[wedge.faces] = n;
            wedge.third[wedge.faces] = place(vertex(scene, scene.edge_opposite[k])) - a;
        }
        const auto corner = [&](int c) { return scene.corner_normal[3 * static_cast<int64_t>(face) + c]; };
        if (scene.corner_normal && (k == first || wedge.smooth))
            wedge.smooth = corner(0) >= 0 && corner(1) >= 0 && corner(2) >= 0;
        ++wedge.faces;
        wedge.same_surface &= scene.face_material[face] == scene.face_material[scene.edge_faces[first]];
    }
    // Only where it decides: seams take a look at every attribute.
    if (wedge.flat()) wedge.same_surface = !is_seam(edges.tables, edge);
    return wedge;
}

// Share of an edge's length on the screen by which it is sampled: 0 if it can't carry a jump. `reach`: by how
// much the rays from other points of the lens differ from `ray`; what is a silhouette from any of them counts
// as one.
double jump_weight(const Wedge& wedge, V ray, double reach, V t, int solid_side, bool sharp) {
    if (wedge.faces == 0 || wedge.flat()) return 0.0;
    if (wedge.faces != 2 || !wedge.same_surface) return 1.0;  // border or junction
    const V sheet = cross(ray, t);                            // normal of the sheet through camera and edge
    const double side[2] = {dot(sheet, wedge.third[0]), dot(sheet, wedge.third[1])};
    if (side[0] * side[1] >= 0.0) return 1.0;  // silhouette
    for (int k = 0; k < 2; ++k)
        if (std::abs(side[k]) <= reach * length(cross(t, wedge.third[k]))) return 1.0;
    // The radiance of flat faces differs by about the angle between them. Where smooth normals go on across
    // the edge, only light between the planes of both counts, which grazes.
    double crease = length(wedge.normal[0] - wedge.normal[1]);
    if (wedge.smooth) crease *= crease;
    crease = std::clamp(crease, sharp ? kLeastSharp : kLeastCrease, 1.0);
    return solid_side * dot(wedge.normal[0], ray) > reach ? kHidden * crease : crease;
}

// Whether two faces may lie on one side of the sheet through the edge and a point of a ball around `d` (from
// the edge; or, of directions, of the cone around d whose angle has the sine `radius`). With the normals
// n0 = t x c0 and n1 = c1 x t (equal for a flat pair), a point y sees the edge as a silhouette iff n0.(y - a)
// and n1.(y - a) differ in sign.
bool may_be_silhouette(const Wedge& wedge, V t, V d, double radius) {
    if (wedge.faces != 2) return true;
    // Rounding must not lose an edge that the kernels' arithmetic sees as a silhouette.
    const double reach = radius + 1e-5 * length(d);
    const V n0 = cross(t, wedge.third[0]), n1 = cross(wedge.third[1], t);
    const double h0 = dot(n0, d) / std::max(length(n0), 1e-300);
    const double h1 = dot(n1, d) / std::max(length(n1), 1e-300);
    return !(h0 > reach && h1 > reach) && !(h0 < -reach && h1 < -reach);
}

// Bound of the light that edges from a along t may take from surfaces: of the nodes among which a light is
// picked, those that may see it as a silhouette, by what they give at its distance.
double hidden_light(const LightView& lights, const Wedge& wedge, V a, V t, bool all_sides) {
    double sum = 0.0;
    for (int32_t k = 0; k < lights.top; ++k) {
        const LightNode& n = lights.nodes[k];
        const double power = std::max(static_cast<double>(n.power), 1e-30);
        if (n.radius < 0.0f) {
            const double sine = n.cos_o < 0.0f ? 1.0 : static_cast<double>(n.sin_o);
            if (all_sides || may_be_silhouette(wedge, t, vector(n.axis), sine)) sum += power;
            continue;
        }
        const V d = vector(n.center) - a;
        const double radius = n.radius;
        if (all_sides || may_be_silhouette(wedge, t, d, radius))
            sum += power / (dot(d, d) + radius * radius + 1e-30);
    }
    return sum;
}

// Where candidates are listed: silhouettes, borders and sharp creases first, then blunt ones, each by tiles
// of the picture along a Z-order curve (Morton 1966). Neighbours on the list then are of one kind and place,
// so that systematic samples are spread evenly and a guide can tell of each by its neighbours.
constexpr uint32_t kTileBits = 6, kTiles = 1u << (2 * kTileBits), kPlaces = 2 * kTiles;
constexpr double kBlunt = 0.5;

uint32_t place_of(const CameraView& camera, const PictureFrame::Piece& piece, double weight) {
    const auto tile = [](double x, int32_t size) {
        return static_cast<uint32_t>(std::clamp(x / size, 0.0, 0.999) * (1u << kTileBits));
    };
    const uint32_t x = tile(piece.x, camera.width), y = tile(piece.y, camera.height);
    uint32_t place = weight < kBlunt ? kTiles : 0u;
    for (uint32_t k = 0; k < kTileBits; ++k)
        place |= ((x >> k & 1u) << (2 * k)) | ((y >> k & 1u) << (2 * k + 1));
    return place;
}

// Candidates of all edges by visit(edge, mesh, add) over blocks of edges in parallel, joined by place.
template <typename Visit>
Candidates collect(const SceneView& scene, const EdgeList& edges, const Visit& visit) {
    struct Block {
        std::vector<int32_t> edge, instance;
        std::vector<float> u0, u1;
        std::vector<double> mass;
        std::vector<uint32_t> place;
    };
    const int64_t count = edges.count(), blocks = (count + kEdgeBlock - 1) / kEdgeBlock;
    const bool placed = !edges.tables.instance_mesh.empty();
    std::vector<Block> parts(static_cast<size_t>(blocks));
    parallel_for(edges.threads, blocks, nullptr, [&](int, int64_t k) {
        Block& part = parts[static_cast<size_t>(k)];
        int64_t mesh = 0;
        for (int64_t edge = k * kEdgeBlock; edge < std::min(count, (k + 1) * kEdgeBlock); ++edge) {
            const auto face = static_cast<int32_t>(scene.edge_faces[scene.edge_face_first[edge]]);
            while (face >= scene.mesh_first_face[mesh + 1]) ++mesh;
            visit(edge, mesh, [&](int32_t instance, double u0, double u1, double mass, uint32_t place) {
                if (!(mass > 0.0)) return;
                part.place.push_back(place);
                part.edge.push_back(static_cast<int32_t>(edge));
                if (placed) part.instance.push_back(instance);
                part.u0.push_back(static_cast<float>(u0));
                part.u1.push_back(static_cast<float>(u1));
                part.mass.push_back(mass);
            });
        }
    });
    // By place, and where that is the same in the order of edges: a counting sort.
    std::vector<size_t> at(kPlaces + 1);
    for (const Block& part : parts)
        for (uint32_t place : part.place) ++at[place + 1];
    for (size_t k = 0; k < kPlaces; ++k) at[k + 1] += at[k];
    const size_t all = at[kPlaces];
    Candidates out;
    out.edge.resize(all), out.u0.resize(all), out.u1.resize(all), out.cumulative.resize(all + 1);
    if (placed) out.instance.resize(all);
    for (const Block& part : parts) {
        for (size_t k = 0; k < part.edge.size(); ++k) {
            const size_t to = at[part.place[k]]++;
            out.edge[to] = part.edge[k];
            if (placed) out.instance[to] = part.instance[k];
            out.u0[to] = part.u0[k], out.u1[to] = part.u1[k];
            out.cumulative[to + 1] = part.mass[k];
        }
    }
    for (size_t k = 0; k < all; ++k) out.cumulative[k + 1] += out.cumulative[k];
    return out;
}

// The instances of each mesh.
std::vector<std::vector<int32_t>> instances_of(const SceneTables& tables) {
    std::vector<std::vector<int32_t>> instances(static_cast<size_t>(tables.visible_meshes));
    for (size_t k = 0; k < tables.instance_mesh.size(); ++k)
        instances[static_cast<size_t>(tables.instance_mesh[k])].push_back(static_cast<int32_t>(k));
    return instances;
}

}  // namespace

std::vector<Vector> unit_normals(const SceneTables& t, int threads) {
    const auto faces = static_cast<int64_t>(t.faces.size() / 3);
    std::vector<Vector> normals(static_cast<size_t>(faces));
    parallel_for(threads, (faces + kEdgeBlock - 1) / kEdgeBlock, nullptr, [&](int, int64_t block) {
        for (int64_t f = block * kEdgeBlock; f < std::min(faces, (block + 1) * kEdgeBlock); ++f) {
            const auto corner = [&](int64_t k) {
                return vector(&t.vertices[3 * static_cast<size_t>(t.faces[static_cast<size_t>(3 * f + k)])]);
            };
            normals[static_cast<size_t>(f)] = unit_normal(corner(0), corner(1), corner(2));
        }
    });
    return normals;
}

Candidates primary_candidates(const SceneView& scene, const EdgeList& edges, const Asked& asked) {
    const PictureFrame frame(scene.camera);
    const SceneTables& tables = edges.tables;
    const bool sharp = scene.lights.kinds & (1 << kPointSource | 1 << kDirectionLight);
    const auto instances = instances_of(tables);
    return collect(scene, edges, [&](int64_t edge, int64_t mesh, const auto& add) {
        const auto& copies = instances[static_cast<size_t>(mesh)];
        if (!asked.camera && !asked.moving[static_cast<size_t>(mesh)] &&
            !(asked.instances && !copies.empty()))
            return;
        if (!(tables.mesh_mask[static_cast<size_t>(mesh)] & (1 << kCameraRay))) return;
        const auto visit = [&](int32_t instance) {
            const Placement place{instance < 0 ? nullptr : scene.instance_to_world + 12 * int64_t{instance}};
            const V a = place(vertex(scene, scene.edge_vertices[2 * edge]));
            const V b = place(vertex(scene, scene.edge_vertices[2 * edge + 1]));
            double weight = -1.0;  // found for edges that are in the picture only
            frame.pieces(a, b, [&](const PictureFrame::Piece& piece) {
                if (weight < 0.0)
                    weight = jump_weight(wedge_of(scene, edges, edge, place), frame.ray_through(a),
                                         frame.lens_reach(), b - a, edges.solid_side[mesh], sharp);
                add(instance, piece.u0, piece.u1, piece.pixels * weight,
                    place_of(scene.camera, piece, weight));
            });
        };
        if (copies.empty()) visit(-1);
        for (int32_t instance : copies) visit(instance);
    });
}

Candidates shadow_candidates(const SceneView& scene, const EdgeList& edges, bool environment) {
    const SceneTables& tables = edges.tables;
    const auto instances = instances_of(tables);
    return collect(scene, edges, [&](int64_t edge, int64_t mesh, const auto& add) {
        const auto visit = [&](int32_t instance) {
            const Placement place{instance < 0 ? nullptr : scene.instance_to_world + 12 * int64_t{instance}};
            const V a = place(vertex(scene, scene.edge_vertices[2 * edge]));
            const V t = place(vertex(scene, scene.edge_vertices[2 * edge + 1])) - a;
            const Wedge wedge = wedge_of(scene, edges, edge, place);
            if (wedge.faces == 0 || wedge.flat()) return;
            // Two faces that let different shares pass hide light from all sides.
            const bool all_sides =
                (scene.all_flags & kHasTransparency) && (!wedge.same_surface || is_seam(tables, edge));
            double mass = length(t);
            if (environment) {
                // Times the width of the wedges of directions in which it is a silhouette: the angle between
                // n0 = t x c0 and n1 = c1 x t, all directions if there are not two faces.
                const V n0 = cross(t, wedge.third[0]), n1 = cross(wedge.third[1], t);
                mass *=
                    wedge.faces == 2 && !all_sides ? std::atan2(length(cross(n0, n1)), dot(n0, n1)) : M_PI;
            } else {
                mass *= hidden_light(scene.lights, wedge, a, t, all_sides);
            }
            // A line that touches a concave edge with both faces on one side runs inside the body.
            const bool concave =
                wedge.faces == 2 && edges.solid_side[mesh] * dot(wedge.normal[0], wedge.third[1]) > 0.0;
            add(instance, 0.0, 1.0, concave ? kHidden * mass : mass, 0u);
        };
        const auto& copies = instances[static_cast<size_t>(mesh)];
        if (copies.empty()) visit(-1);
        for (int32_t instance : copies) visit(instance);
    });
}

Candidates over_directions(const Candidates& edges, double wanted, bool chains) {
    const auto size = static_cast<double>(edges.size());
    Candidates out;
    if (edges.size() == 0) return out;
    // Directions first: what an edge hides depends more on them than on the place along it.
    const double each = std::max(1.0, wanted / size);
    out.direction_cells = static_cast<int32_t>(std::clamp(std::floor(std::sqrt(each)), 1.0, kMostDirections));
    const int32_t n = out.direction_cells, kinds = chains ? 2 : 1;
    const double pieces = std::max(1.0, wanted / (n * n));
    for (int32_t kind = 0; kind < kinds; ++kind) {
        const double share = !chains ? 1.0 : kind == 0 ? 1.0 - kChainedShare : kChainedShare;
        for (int64_t k = 0; k < edges.size(); ++k) {
            const auto i = static_cast<size_t>(k);
            const double mass = edges.cumulative[i + 1] - edges.cumulative[i];
            const auto parts = static_cast<int64_t>(std::max(1.0, std::round(pieces * mass / edges.mass())));
            for (int64_t part = 0; part < parts; ++part) {
                const float length = (edges.u1[i] - edges.u0[i]) / static_cast<float>(parts);
                for (int32_t row = 0; row < n; ++row) {
                    for (int32_t column = 0; column < n; ++column) {
                        out.edge.push_back(edges.edge[i]);
                        if (!edges.instance.empty()) out.instance.push_back(edges.instance[i]);
                        out.u0.push_back(edges.u0[i] + length * static_cast<float>(part));
                        out.u1.push_back(edges.u0[i] + length * static_cast<float>(part + 1));
                        // There and back, so that what follows each other is near each other.
                        const int32_t place = row % 2 ? n - 1 - column : column;
                        out.cell.push_back((row * n + place) | (kind ? kChained : 0));
                        out.cumulative.push_back(out.cumulative.back() +
                                                 share * mass / static_cast<double>(parts * n * n));
                    }
                }
            }
        }
    }
    return out;
}

}  // namespace edgegrad
