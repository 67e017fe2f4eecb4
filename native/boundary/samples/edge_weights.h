// The weights by which edges are sampled, for packets of edges. A weight estimates from an edge's shape and
// place how large the discontinuity across it is. It is 0 only where there can be none.
#pragma once

#include "sampling/z_order.h"
#include "scene/geometry.h"
#include "simd/elementary.h"
#include "simd/lanes.h"
#include "tasks/edge_weight_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// The geometry of an edge and its faces.
struct Wedges {
    Vec3 a, t;          // from the first end
    Int faces;          // number of faces with an area
    Vec3 normal[2];     // of the first two faces, unit, by winding order
    Vec3 oriented[2];   // of the same, along t x third[0] and third[1] x t; equal for a flat pair
    Vec3 third[2];      // the corners off the edge, from a
    Mask same_surface;  // one material and no seam
    Mask smooth;        // both faces have shading normals at all corners
    Mask flat;          // two faces in one plane, of one orientation and surface: no discontinuity
};

EG_INLINE Vec3 placed_vertex(const SceneView& scene, int32_t instance, Int vertex) {
    const Vec3 p = gather3(scene.vertices, vertex);
    if (instance < 0) return p;
    const Placement m = gather_placement(scene, splat(instance));
    return Vec3{dot(m.x, p), dot(m.y, p), dot(m.z, p)} + m.origin;
}

// For an edge that has a face without area, or does not have two faces: counts the faces with an area and
// finds the places of the first two in the edge's list.
EG_INLINE void find_faces(const SceneView& scene, const EdgeWeightTask& task, int lane, Int edge,
                          Int (&slot)[2], Int& faces, Mask& same_surface) {
    const uint32_t first = scene.edge_face_first[edge[lane]], last = scene.edge_face_first[edge[lane] + 1];
    faces[lane] = 0;
    same_surface[lane] = -1;
    for (uint32_t k = first; k < last; ++k) {
        const uint32_t face = scene.edge_faces[k];
        const float* n = task.normal + 3 * static_cast<int64_t>(face);
        if (n[0] == 0.0f && n[1] == 0.0f && n[2] == 0.0f) continue;  // a face without area has no border
        if (faces[lane] < 2) slot[faces[lane]][lane] = static_cast<int32_t>(k);
        if (scene.face_material[face] != scene.face_material[scene.edge_faces[first]]) same_surface[lane] = 0;
        ++faces[lane];
    }
}

EG_INLINE Mask has_smooth_corners(const SceneView& scene, Int face) {
    Rows corner[3];
    gather_corners(scene.corner_normal, face, corner);
    return (packet(corner[0]) >= 0) & (packet(corner[1]) >= 0) & (packet(corner[2]) >= 0);
}

EG_INLINE Wedges wedges_at(const SceneView& scene, const EdgeWeightTask& task, int64_t at) {
    // Load the edges and their ends
    const auto list = [](const uint32_t* table) { return reinterpret_cast<const int32_t*>(table); };
    const int64_t left = task.count - at;
    const Int lane = lane_index();
    const Int edge = static_cast<int32_t>(task.first + at) +
                     select(lane < static_cast<int32_t>(left < W ? left : W), lane, splat(0));
    Wedges w;
    Int first, from, to;
    if (left >= W) {
        const int64_t at_edge = task.first + at;
        first = load(list(scene.edge_face_first) + at_edge);
        w.faces = load(list(scene.edge_face_first) + at_edge + 1) - first;
        load_pairs(list(scene.edge_vertices) + 2 * at_edge, from, to);
    } else {
        first = gather(scene.edge_face_first, edge);
        w.faces = gather(scene.edge_face_first, edge + 1) - first;
        from = gather(scene.edge_vertices, edge * 2);
        to = gather(scene.edge_vertices, edge * 2 + 1);
    }
    // Load the first two faces and their corners off the edge
    Int slot[2] = {first, first + select(w.faces > 1, splat(1), splat(0))}, face[2], corner[2];
    if (left >= W && !any(w.faces != 2)) {
        load_pairs(list(scene.edge_faces) + first[0], face[0], face[1]);
        load_pairs(list(scene.edge_opposite) + first[0], corner[0], corner[1]);
    } else {
        for (int k = 0; k < 2; ++k) {
            face[k] = gather(scene.edge_faces, slot[k]);
            corner[k] = gather(scene.edge_opposite, slot[k]);
        }
    }
    // Handle edges without two regular faces lane by lane
    Vec3 wound[2];
    Mask no_area = splat(0);
    for (int k = 0; k < 2; ++k) {
        wound[k] = gather3(task.normal, face[k]);
        no_area |= dot(wound[k], wound[k]) == 0.0f;
    }
    w.same_surface = gather(scene.face_material, face[0]) == gather(scene.face_material, face[1]);
    const Mask odd = no_area | (w.faces != 2);
    if (any(odd)) {
        for (int i = 0; i < W; ++i)
            if (odd[i]) find_faces(scene, task, i, edge, slot, w.faces, w.same_surface);
        for (int k = 0; k < 2; ++k) {
            face[k] = gather(scene.edge_faces, slot[k]);
            corner[k] = gather(scene.edge_opposite, slot[k]);
            wound[k] = gather3(task.normal, face[k]);
        }
    }
    if (task.seam)
        for (int i = 0; i < W; ++i)
            if (task.seam[at + (i < left ? i : 0)]) w.same_surface[i] = 0;

    // Place the edge and orient the normals of its faces
    w.a = placed_vertex(scene, task.instance, from);
    w.t = placed_vertex(scene, task.instance, to) - w.a;
    for (int k = 0; k < 2; ++k) {
        w.third[k] = placed_vertex(scene, task.instance, corner[k]) - w.a;
        Vec3 n = k == 0 ? cross(w.t, w.third[k]) : cross(w.third[k], w.t);
        if (task.instance < 0) {
            // The faces' normals were computed in double precision, which slivers need.
            w.normal[k] = wound[k];
            w.oriented[k] = select(dot(n, wound[k]) < 0.0f, -wound[k], wound[k]);
            continue;
        }
        const Vec3 a = gather3(scene.vertices, from), c = gather3(scene.vertices, corner[k]) - a;
        const Vec3 t = gather3(scene.vertices, to) - a;
        const Vec3 still = k == 0 ? cross(t, c) : cross(c, t);
        n = unit_vector(n);
        w.oriented[k] = n;
        w.normal[k] = select(dot(still, wound[k]) < 0.0f, -n, n);
    }
    w.smooth = splat(0);
    // Classify the pair of faces
    if (scene.corner_normal)
        w.smooth = has_smooth_corners(scene, face[0]) & has_smooth_corners(scene, face[1]);
    const Vec3 sine = cross(w.normal[0], w.normal[1]);
    w.flat = (w.faces == 2) & w.same_surface & (dot(w.normal[0], w.normal[1]) > 0.0f) &
             (dot(sine, sine) < kCoplanar * kCoplanar);
    return w;
}

// The factor on the projected length of an edge in its weight.
EG_INLINE Float picture_weight(const EdgeWeightTask& task, const Wedges& w, Vec3 ray) {
    // Lower bounds of the factor of a crease, however blunt: shadows rather than the angle may cause a
    // discontinuity there. Lights without size cast sharp shadows and need a larger bound. kHidden is the
    // factor of edges inside or behind a solid body, which are visible only if the mesh intersects itself.
    constexpr float kLeastCrease = 0.005f, kLeastSharp = 0.05f, kHidden = 0.05f;
    const Vec3 sheet = cross(ray, w.t);  // normal of the sheet through camera and edge
    const Float side[2] = {dot(sheet, w.third[0]), dot(sheet, w.third[1])};
    // An edge that is a silhouette from any point of the lens counts as a silhouette.
    Mask whole = (w.faces != 2) | ~w.same_surface | (side[0] * side[1] >= 0.0f);
    if (task.lens_reach > 0.0f) {
        for (int k = 0; k < 2; ++k) {
            const Vec3 height = cross(w.t, w.third[k]);
            whole |= abs(side[k]) <= task.lens_reach * sqrt(dot(height, height));
        }
    }
    // The radiance of two flat faces differs by about the angle between them. Where smooth normals continue
    // across the edge, only light that grazes the faces differs, so the square of the angle is used.
    const Vec3 bend = w.normal[0] - w.normal[1];
    Float crease = sqrt(dot(bend, bend));
    crease = select(w.smooth, crease * crease, crease);
    crease = min(max(crease, task.sharp ? kLeastSharp : kLeastCrease), splat(1.0f));
    const auto side_of_solid = static_cast<float>(task.solid_side);
    const Mask behind = side_of_solid * dot(w.normal[0], ray) > task.lens_reach;
    // If both faces of a concave edge lie on one side of the ray, the ray runs inside the body at the edge.
    const Mask concave = (w.faces == 2) & (side_of_solid * dot(w.normal[0], w.third[1]) > 0.0f);
    const Mask inside = concave & (side[0] * side[1] > 0.0f) & splat(task.lens_reach > 0.0f ? 0 : -1);
    const Float weight =
        select(whole, select(inside, splat(kHidden), splat(1.0f)), select(behind, crease * kHidden, crease));
    return select(w.faces == 0, splat(0.0f), weight);
}

// Computes the projected lengths, in pixels, of edges that lie completely in the frame. Edges outside the
// frame get weight 0. The host clips the others.
EG_INLINE void place_in_frame(const CameraView& c, const EdgeWeightTask& task, const Wedges& w, int64_t at,
                              Float weight) {
    Mask out = splat(0);
    Float pixels = splat(-1.0f);
    Int tile = splat(0);
    if (!task.cut_all) {
        // Project both ends and test them against the six planes of the frame
        const Vec3 ends[2] = {w.a - splat3(c.position), w.a + w.t - splat3(c.position)};
        Float sx[2], sy[2];
        Mask beyond[6], whole = splat(-1);
        for (Mask& m : beyond) m = splat(-1);
        const auto size_x = static_cast<float>(c.width), size_y = static_cast<float>(c.height);
        // The slack keeps rounding from excluding edges that are in the frame.
        const float slack = task.margin + 0.01f;
        for (int k = 0; k < 2; ++k) {
            const Float z = -dot(splat3(c.back), ends[k]);
            const Float h = c.kind == kOrthographic ? splat(1.0f) : z;
            const Float u = c.focal * dot(splat3(c.right), ends[k]) + c.principal[0] * h;
            const Float v = c.principal[1] * h - (c.focal / c.pixel_aspect) * dot(splat3(c.up), ends[k]);
            whole &= (z > c.clip_start) & (z < c.clip_end) & (u > 0.0f) & (u < size_x * h) & (v > 0.0f) &
                     (v < size_y * h);
            beyond[0] &= u + slack * h < 0.0f;
            beyond[1] &= (size_x + slack) * h - u < 0.0f;
            beyond[2] &= v + slack * h < 0.0f;
            beyond[3] &= (size_y + slack) * h - v < 0.0f;
            beyond[4] &= z < 0.999f * c.clip_start;
            beyond[5] &= z > 1.001f * c.clip_end;
            const Float over = 1.0f / max(h, 1e-12f);
            sx[k] = u * over, sy[k] = v * over;
        }
        for (const Mask& m : beyond) out |= m;
        // Measure the edges in the frame and find their tiles
        const Float dx = sx[1] - sx[0], dy = sy[1] - sy[0];
        pixels = select(whole, sqrt(dx * dx + dy * dy), pixels);
        const auto tile_of = [](Float twice, float size) {
            constexpr float tiles = 1 << kTileBits;
            const Float at = twice * (0.5f * tiles / size);
            return spread_bits(bits(to_int(min(max(at, splat(0.0f)), splat(tiles - 0.5f)))));
        };
        tile = reinterpret_cast<Int>(tile_of(sx[0] + sx[1], size_x) | (tile_of(sy[0] + sy[1], size_y) << 1));
    }
    store(task.mass + at, select(out, splat(0.0f), weight));
    store(task.pixels + at, pixels);
    store(task.tile + at, tile);
}

// Whether two faces may lie on one side of the plane through the edge and some point of a ball around d
// (relative to the edge). For distant lights d is a direction and `radius` the sine of a cone's half angle. A
// point y sees the edge as a silhouette if n0.(y - a) and n1.(y - a) have different signs.
EG_INLINE Mask may_be_silhouette(const Wedges& w, Vec3 d, float radius) {
    // Enlarge the radius, so that rounding cannot exclude an edge that sampling would see as a silhouette.
    const Float reach = radius + 1e-5f * sqrt(dot(d, d));
    const Float h0 = dot(w.oriented[0], d), h1 = dot(w.oriented[1], d);
    return (w.faces != 2) | ~(((h0 > reach) & (h1 > reach)) | ((h0 < -reach) & (h1 < -reach)));
}

// An upper bound of the light that an edge may occlude: the sum over the top nodes of the light tree that may
// see the edge as a silhouette, of their power over squared distance. A mesh that occludes nothing of itself
// is skipped as its own light. It is closest to its own edges, so they would attract most samples without
// contributing.
EG_INLINE Float hidden_light(const LightView& lights, const EdgeWeightTask& task, const Wedges& w,
                             Mask all_sides) {
    Float sum = splat(0.0f);
    for (int32_t k = 0; k < lights.top; ++k) {
        if (task.light_mesh[k] == task.clear_mesh && !any(all_sides)) continue;
        const LightNode& n = lights.nodes[k];
        const Float power = splat(n.power > 1e-30f ? n.power : 1e-30f);
        if (n.radius < 0.0f) {
            const Mask may =
                all_sides | may_be_silhouette(w, splat3(n.axis), n.cos_o < 0.0f ? 1.0f : n.sin_o);
            sum += select(may, power, splat(0.0f));
            continue;
        }
        const Vec3 d = splat3(n.center) - w.a;
        const Mask may = all_sides | may_be_silhouette(w, d, n.radius);
        const Float r2 = dot(d, d) + (n.radius * n.radius + 1e-30f);
        sum += select(may, power / r2 + (n.by_way / sqrt(r2) + n.by_way2), splat(0.0f));
    }
    return min(sum, splat(1e30f));
}

// For lights: the length of the edge times the light that it may occlude. For the environment: the length
// times the angle between the face normals, which is the width of the wedges of directions in which the edge
// is a silhouette. The angle is pi without two faces.
EG_INLINE Float hiding_weight(const SceneView& scene, const EdgeWeightTask& task, const Wedges& w) {
    // A line through a concave edge with both faces on one side runs inside the body.
    constexpr float kHidden = 0.05f, kPi = 3.14159265f;
    // Two faces of different transparency are a shadow boundary from all sides.
    const bool borders = task.kind == kBorderWeight;
    const Mask all_sides = ~w.same_surface & splat(borders || scene.all_flags & kHasTransparency ? -1 : 0);
    Float mass = sqrt(dot(w.t, w.t));
    if (task.kind != kLightWeight) {
        const Vec3 sine = cross(w.oriented[0], w.oriented[1]);
        const Float angle = atan2(sqrt(dot(sine, sine)), dot(w.oriented[0], w.oriented[1]));
        // Sampling does not aim at wedges narrower than kLeastWedge.
        const Float wide = borders ? max(angle, sqrt(angle * kLeastWedge)) : angle;
        mass *= select((w.faces == 2) & ~all_sides, wide, splat(kPi));
    } else {
        mass *= hidden_light(scene.lights, task, w, all_sides);
    }
    const Mask concave =
        (w.faces == 2) & (static_cast<float>(task.solid_side) * dot(w.normal[0], w.third[1]) > 0.0f);
    return select(w.faces == 0, splat(0.0f), select(concave & splat(borders ? 0 : -1), kHidden * mass, mass));
}

static void edge_weights_kernel(const SceneView& scene, const EdgeWeightTask& task) {
    const CameraView& c = scene.camera;
    for (int64_t at = 0; at < task.count; at += W) {
        Wedges w = wedges_at(scene, task, at);
        store(task.flat + at, w.flat);
        // A flat pair that is sampled nevertheless is a seam (the host tests that).
        w.same_surface &= ~w.flat;
        if (task.kind == kPictureWeight) {
            const Vec3 ray = c.kind == kOrthographic ? -splat3(c.back) : w.a - splat3(c.position);
            place_in_frame(c, task, w, at, picture_weight(task, w, ray));
        } else {
            store(task.mass + at, hiding_weight(scene, task, w));
        }
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
