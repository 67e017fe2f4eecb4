// Vertices, faces and meshes where instances place them, in double precision.
#pragma once

#include <algorithm>
#include <cmath>

#include "boundary/meshes/trees/face_tree.h"
#include "scene/tables.h"
#include "scene/view.h"
#include "util/double_vector.h"

namespace edgegrad {

inline Vector vertex(const SceneView& scene, int64_t k) { return vector_at(scene.vertices + 3 * k); }

// The transform of an instance, or the identity.
struct Placement {
    const float* matrix = nullptr;  // three rows of four; null is the identity

    static Placement of(const SceneView& scene, int32_t instance) {
        return {instance < 0 ? nullptr : scene.instance_to_world + 12 * int64_t{instance}};
    }
    static Placement of(const GeometryTables& t, int32_t instance) {
        return {instance < 0 ? nullptr : t.instance_to_world.data() + 12 * int64_t{instance}};
    }
    Vector operator()(Vector p) const {
        if (!matrix) return p;
        const auto row = [&](const float* m) {
            return m[0] * p.x + m[1] * p.y + m[2] * p.z + static_cast<double>(m[3]);
        };
        return {row(matrix), row(matrix + 4), row(matrix + 8)};
    }
};

// The ends of an edge.
struct EdgeEnds {
    Vector a, b;

    static EdgeEnds of(const SceneView& scene, const Placement& place, int64_t edge) {
        return {place(vertex(scene, scene.edge_vertices[2 * edge])),
                place(vertex(scene, scene.edge_vertices[2 * edge + 1]))};
    }
};

// Boxes are in single precision: a distance by which their sides may be off, from the largest coordinate.
inline float rounding_of(const Box& box) {
    constexpr float kRounding = 1e-6f;
    float size = 0.0f;
    for (int c = 0; c < 3; ++c) size = std::max({size, std::abs(box.low[c]), std::abs(box.high[c])});
    return kRounding * size;
}

inline Box padded(Box box) {
    const float by = rounding_of(box);
    for (int c = 0; c < 3; ++c) box.low[c] -= by, box.high[c] += by;
    return box;
}

inline void add_point(Box& box, Vector p) {
    const float at[3] = {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
    box.add(at);
}

// The bounding box of a box's corners after a map.
template <typename Map>
Box mapped(const Box& box, const Map& map) {
    Box out;
    for (int k = 0; k < 8; ++k)
        add_point(out, map(Vector{k & 1 ? box.high[0] : box.low[0], k & 2 ? box.high[1] : box.low[1],
                                  k & 4 ? box.high[2] : box.low[2]}));
    return out;
}

// A mesh placed by an instance, or a mesh that is not instanced (instance -1).
struct PlacedMesh {
    int32_t mesh, instance;
    Placement place;
    Vector back[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};  // rows of the inverse of the linear part
    Box box;                                             // bounds in the world

    // `mesh_box` is the mesh's bounding box in its own space.
    PlacedMesh(const GeometryTables& tables, int32_t of_mesh, int32_t of_instance, const Box& mesh_box)
        : mesh(of_mesh), instance(of_instance), place(Placement::of(tables, of_instance)), box(mesh_box) {
        if (!place.matrix) return;
        box = mapped(box, place);
        const Vector x = vector_at(place.matrix), y = vector_at(place.matrix + 4),
                     z = vector_at(place.matrix + 8);
        // Scene.validate rejects singular transforms.
        const double inverse = 1.0 / dot(x, cross(y, z));
        const Vector column[3] = {cross(y, z) * inverse, cross(z, x) * inverse, cross(x, y) * inverse};
        back[0] = {column[0].x, column[1].x, column[2].x};
        back[1] = {column[0].y, column[1].y, column[2].y};
        back[2] = {column[0].z, column[1].z, column[2].z};
    }
    // A point in the mesh's own space, and the bounds there of a box.
    Vector local(Vector world) const {
        if (!place.matrix) return world;
        const Vector d = world - Vector{place.matrix[3], place.matrix[7], place.matrix[11]};
        return {dot(back[0], d), dot(back[1], d), dot(back[2], d)};
    }
    Box local(const Box& world) const {
        return place.matrix ? padded(mapped(world, [&](Vector p) { return local(p); })) : world;
    }
};

// The part of the world in which two placed meshes may meet.
inline Box common_box(const PlacedMesh& one, const PlacedMesh& other) {
    Box out;
    for (int c = 0; c < 3; ++c) {
        out.low[c] = std::max(one.box.low[c], other.box.low[c]);
        out.high[c] = std::min(one.box.high[c], other.box.high[c]);
    }
    return padded(out);
}

}  // namespace edgegrad
