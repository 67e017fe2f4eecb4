// Vertices where instances place them, in double precision.
#pragma once

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

}  // namespace edgegrad
