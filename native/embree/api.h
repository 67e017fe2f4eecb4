// Embree 4's C interface, as far as Edgegrad uses it. It is declared here because the `embreex` wheel
// contains the library without headers. Layouts follow include/embree4/rtcore_{common,ray,scene,geometry}.h
// of Embree 4.x (https://github.com/RenderKit/embree, Apache 2.0). `library.cpp` checks the major version.
#pragma once

#include <cstddef>
#include <cstdint>

namespace edgegrad::embree {

using Device = void*;
using SceneHandle = void*;
using Geometry = void*;

constexpr uint32_t kInvalidId = 0xFFFFFFFFu;

enum Property : int { kVersionMajor = 1, kVersionMinor = 2, kVersionPatch = 3, kRayMaskSupported = 64 };
enum GeometryType : int { kTriangle = 0, kUser = 120, kInstance = 121 };
enum BufferType : int { kIndexBuffer = 0, kVertexBuffer = 1 };
enum Format : int { kUInt3 = 0x5003, kFloat3 = 0x9003, kFloat3x4RowMajor = 0x9134 };
enum Quality : int { kLow = 0, kMedium = 1, kHigh = 2, kRefit = 3 };
enum SceneFlag : int { kDynamic = 1 << 0, kRobust = 1 << 2 };
enum QueryFlag : int { kIncoherent = 0, kInvokeArgumentFilter = 1 << 1, kCoherent = 1 << 16 };

struct QueryContext {
    uint32_t inst_id = kInvalidId;
    uint32_t inst_prim_id = kInvalidId;
};

// RTCRayN and RTCHitN: arrays of W values each, in this order.
template <int W>
struct alignas(W == 1 ? 16 : 4 * W) Ray {
    float org_x[W], org_y[W], org_z[W], tnear[W];
    float dir_x[W], dir_y[W], dir_z[W], time[W];
    float tfar[W];
    uint32_t mask[W], id[W], flags[W];
};

template <int W>
struct alignas(W == 1 ? 16 : 4 * W) Hit {
    float ng_x[W], ng_y[W], ng_z[W];
    float u[W], v[W];
    uint32_t prim_id[W], geom_id[W], inst_id[W], inst_prim_id[W];
};

template <int W>
struct RayHit {
    Ray<W> ray;
    Hit<W> hit;
};

static_assert(sizeof(Ray<1>) == 48 && sizeof(Hit<1>) == 48 && sizeof(RayHit<1>) == 96);
static_assert(sizeof(Ray<4>) == 192 && sizeof(Hit<4>) == 144 && sizeof(RayHit<4>) == 336);
static_assert(sizeof(Ray<8>) == 384 && sizeof(Hit<8>) == 288 && sizeof(RayHit<8>) == 672);
static_assert(sizeof(Ray<16>) == 768 && sizeof(Hit<16>) == 576 && sizeof(RayHit<16>) == 1344);

struct FilterArguments {
    int* valid;
    void* geometry_user;
    QueryContext* context;
    void* ray;
    void* hit;
    uint32_t n;
};
using Filter = void (*)(const FilterArguments*);

// RTCIntersectFunctionNArguments and RTCOccludedFunctionNArguments, which have the same layout: the first one
// has n values of RayHit, the second one of Ray.
struct UserArguments {
    int* valid;
    void* user;
    uint32_t primitive;
    QueryContext* context;
    void* rays;
    uint32_t n;
    uint32_t geom_id;
};
using UserFunction = void (*)(const UserArguments*);

// RTCBounds and RTCBoundsFunctionArguments.
struct alignas(16) Bounds {
    float lower[4], upper[4];
};
struct BoundsArguments {
    void* user;
    uint32_t primitive, time_step;
    Bounds* bounds;
};
using BoundsFunction = void (*)(const BoundsArguments*);

// RTCIntersectArguments and RTCOccludedArguments, which have the same layout.
struct QueryArguments {
    int flags = kIncoherent;
    uint32_t feature_mask = 0xFFFFFFFFu;
    QueryContext* context = nullptr;
    Filter filter = nullptr;
    UserFunction user_function = nullptr;
    float min_width_distance_factor = 0.0f;
};

// Functions, resolved from the library's own handle and never from the global scope: inside Blender the
// global scope contains Blender's own libembree4.
struct Api {
    Device (*new_device)(const char*);
    void (*release_device)(Device);
    int (*device_error)(Device);
    ptrdiff_t (*device_property)(Device, int);
    SceneHandle (*new_scene)(Device);
    void (*release_scene)(SceneHandle);
    void (*set_scene_flags)(SceneHandle, int);
    void (*set_scene_quality)(SceneHandle, int);
    void (*commit_scene)(SceneHandle);
    Geometry (*new_geometry)(Device, int);
    void (*release_geometry)(Geometry);
    void (*commit_geometry)(Geometry);
    void (*set_geometry_quality)(Geometry, int);
    void (*set_shared_buffer)(Geometry, int, unsigned, int, const void*, size_t, size_t, size_t);
    void (*update_buffer)(Geometry, int, unsigned);
    void (*enable_argument_filter)(Geometry, bool);
    void (*set_geometry_mask)(Geometry, unsigned);
    void (*set_primitive_count)(Geometry, unsigned);
    void (*set_user_data)(Geometry, void*);
    void (*set_bounds_function)(Geometry, BoundsFunction, void*);
    void (*set_instanced_scene)(Geometry, SceneHandle);
    void (*set_transform)(Geometry, unsigned, int, const void*);
    void (*attach_geometry_by_id)(SceneHandle, Geometry, unsigned);
    void (*intersect1)(SceneHandle, void*, QueryArguments*);
    void (*intersect4)(const int*, SceneHandle, void*, QueryArguments*);
    void (*intersect8)(const int*, SceneHandle, void*, QueryArguments*);
    void (*intersect16)(const int*, SceneHandle, void*, QueryArguments*);
    void (*occluded1)(SceneHandle, void*, QueryArguments*);
    void (*occluded4)(const int*, SceneHandle, void*, QueryArguments*);
    void (*occluded8)(const int*, SceneHandle, void*, QueryArguments*);
    void (*occluded16)(const int*, SceneHandle, void*, QueryArguments*);
};

}  // namespace edgegrad::embree
