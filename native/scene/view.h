// What the kernels read: plain pointers into the engine's tables (core/tables.py has the same names).
#pragma once

#include <cstdint>

#include "embree/api.h"

namespace edgegrad {

// Kinds of finite emitters.
constexpr int32_t kEmissiveTriangle = 0, kPointLight = 1, kSunLight = 2;

struct CameraView {
    float position[3];
    float right[3], up[3], back[3];  // axes X, Y, Z; it looks along -Z
    float focal;                     // pixels
    float principal[2];              // pixels
    int32_t width, height;
    float clip_start, clip_end;
};

struct SceneView {
    const embree::Api* api;
    embree::SceneHandle bvh;

    const float* vertices;              // (V, 3)
    const int32_t* faces;               // (F, 3)
    const int32_t* face_material;       // (F)
    const int32_t* face_moving;         // (F) 1: its vertices are parameters
    const int32_t* mesh_first_face;     // by Embree's geomID
    const float* albedo;                // (M, 3)
    const float* emission;              // (M, 3)
    const int32_t* emission_two_sided;  // (M)
    bool any_emission;

    // Finite emitters, one of which is picked per shading point in proportion to its power.
    int32_t emitter_count;
    const int32_t* emitter_kind;   // one of the kinds above
    const int32_t* emitter_index;  // face, point light or sun
    const float* emitter_cdf;      // (emitter_count + 1) from 0 to 1
    const float* point_position;   // (P, 3)
    const float* point_intensity;  // (P, 3)
    const float* sun_direction;    // (D, 3)
    const float* sun_irradiance;   // (D, 3)

    bool convex;  // one convex body seen from outside: nothing hides light from it

    float environment[3];
    bool has_environment;

    // Edges with their faces (core/topology.py), for the boundary term and for rays that start there.
    const uint32_t* edge_vertices;    // (E, 2)
    const uint32_t* edge_face_first;  // (E + 1)
    const uint32_t* edge_faces;
    const uint32_t* edge_opposite;

    CameraView camera;
};

// Tables that derivatives are taken of: a tangent (read) or a gradient (written). `vertices` starts
// at `first_vertex`: only the span of meshes that move is held.
struct DerivativeView {
    double* vertices;
    int32_t first_vertex;
    double* albedo;
    double* emission;
    double* point_intensity;
    double* sun_irradiance;
    double* environment;
    // What is asked for at all.
    bool want_vertices;
    bool want_colors;  // albedo, emission, lights, environment
};

}  // namespace edgegrad
