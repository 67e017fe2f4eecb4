// What the kernels read: plain pointers into the engine's tables (core/tables/tables.py has the same names).
#pragma once

#include <cstddef>
#include <cstdint>

#include "embree/api.h"
#include "scene/camera_row.h"
#include "scene/lights/environment_view.h"
#include "scene/lights/light_view.h"
#include "scene/material_params.h"
#include "scene/rays/brute_triangle.h"
#include "scene/textures/texture_view.h"

namespace edgegrad {

// Kinds of rays, as bits 1 << kind of what meets them (core/_check.py, RAYS); above them in a mesh's mask the
// sets of shadow casters that lights may name.
enum RayKind : int32_t { kCameraRay, kDiffuseRay, kGlossyRay, kTransmissionRay, kShadowRay, kFirstBlockers };

// Those that surfaces scatter.
constexpr int32_t kScatteredRays = 1 << kDiffuseRay | 1 << kGlossyRay | 1 << kTransmissionRay;

enum CameraKind : int32_t { kPerspective, kOrthographic, kEquirectangular };

constexpr int kFilterSize = 1024;

struct CameraView {
    // Floats that have derivatives, one behind the other (kCameraFloats).
    float position[3];
    float right[3], up[3], back[3];  // axes X, Y, Z; it looks along -Z
    float focal;                     // pixels; orthographic: pixels per metre
    float pixel_aspect;              // height of a pixel by its width
    float principal[2];              // pixels of the rendered window
    float panorama[4];  // longitude and latitude of the full picture's left, right, lower and upper edge
    float aperture_radius, focus_distance, aperture_rotation, aperture_ratio;

    CameraKind kind;
    int32_t aperture_blades;
    int32_t full_width, full_height;
    int32_t window_x, window_y;  // first pixel of the window in the full picture
    int32_t width, height;       // of the window
    float clip_start, clip_end;
    const float*
        filter;  // kFilterSize + 1 places of the pixel filter's inverted distribution; null: box of one pixel
};
constexpr int kCameraFloats = 24;
static_assert(offsetof(CameraView, kind) == kCameraFloats * sizeof(float));

// Flag of what a surface passes through, among the faces of a line (boundary/curves/intersections.h): no
// face, but a row of the light table.
constexpr uint32_t kLightOfTable = 1u << 31;

// Of meshes (scene/contact.h): light from near surfaces may be held on them; light from them may be; not all
// of their normals are those of their faces.
constexpr int32_t kContactFrom = 1, kContactTo = 2, kContactBent = 4;
// Surfaces of a path, from the camera on, on which it is.
constexpr int32_t kFixedDirectionSurfaces = 4;

struct SceneView {
    const embree::Api* api;
    embree::SceneHandle bvh;
    const BruteTriangle* brute_triangles;  // all, where that beats the BVH
    int32_t brute_count;                   // 0: the BVH is used

    const float* vertices;         // (V, 3)
    const int32_t* faces;          // (F, 3)
    const int32_t* face_material;  // (F)
    const int32_t* face_moving;    // (F) 1: its vertices are parameters
    const int32_t*
        face_held;  // (F) 1: its light holds its direction (shading/lights/fixed_direction_light.h), or null
    const int32_t* material_held;      // (M) 1: on surfaces of it
    const int32_t* mesh_first_face;    // by Embree's geomID
    const int32_t* mesh_contact;       // (S) those bits, or null: nothing moves, or no light is held so
    int32_t fixed_direction_surfaces;  // of a path from the camera on, that light is held on
    // Lobes up to this alpha are followed where the camera sees them by such lobes alone
    // (shading/bsdf/followed_lobes.h); 0: none.
    float followed_alpha;
    int32_t mesh_count;             // that rays can hit; instances have the geomIDs from here on
    const int32_t* mesh_mask;       // (S) bits of the rays that meet a mesh
    bool rays_differ;               // some mesh isn't met by all rays
    const int32_t* mesh_receivers;  // (S) bits of the sets of receivers that a mesh is in
    const float* mesh_terminator;   // (S) share of the shadow terminator's offset
    bool any_terminator;
    const int32_t* corner_normal;    // (F, 3) shading normal of each corner, -1: flat; null: all is flat
    const float* normals;            // (N, 3) unit
    const int32_t* instance_mesh;    // (I)
    const float* instance_to_world;  // (I, 3, 4) rows

    const int32_t* material_first_closure;  // (M + 1) its shaders
    const int32_t* closure_kind;            // (L) ShaderKind
    const int32_t* closure_flags;           // (L) ClosureFlag bits
    const float* closure_params;            // (L, kMaterialParams)
    int32_t all_flags, common_flags;        // bits that any, or every, shader has
    bool any_mixture;
    bool emission_varies;  // some emitting surface's radiance isn't one constant

    TextureView textures;

    EnvironmentView sky;
    float environment_rotation[9];
    int32_t environment_mask;

    LightView lights;

    const float* emission;              // (M, 3)
    const int32_t* emission_two_sided;  // (M)

    bool convex;  // a flat sheet, or one convex body seen from outside: nothing hides light from it

    float environment[3];
    bool has_environment;

    // Edges with their faces (core/geometry/topology.py), for the boundary term and for rays that start
    // there.
    const uint32_t* edge_vertices;    // (E, 2)
    const uint32_t* edge_face_first;  // (E + 1)
    const uint32_t* edge_faces;
    const uint32_t* edge_opposite;
    int32_t edge_count;
    const float*
        intersection_ends;  // (crossings, 2, 3) ends of the lines with the numbers from edge_count on,
                            // along which two faces pierce each other (boundary/curves/intersections.h)
    const int32_t*
        intersection_instances;  // (crossings, 2) that place those faces, -1: none does; null: of all

    CameraView camera;
};

// What boundary terms move: tangents (read) or gradients (written). `vertices` starts at `first_vertex`: only
// the span of meshes that move is held.
struct DerivativeView {
    double* vertices;
    int32_t first_vertex;
    double* camera;                // (kCameraFloats)
    double* instance_to_world;     // (I, 12)
    double* light_params;          // (L, kLightParams)
    double* environment_rotation;  // (9)
    // What is asked for at all.
    bool camera_requested;
    bool instances_requested;
    bool lights_requested;
    bool rotation_requested;
};

}  // namespace edgegrad
