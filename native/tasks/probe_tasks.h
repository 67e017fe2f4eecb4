// Tests and measurements of parts of the path tracer: textures, BSDFs, shading code that reads the scene,
// and rays.
#pragma once

#include <cstdint>

#include "scene/differentiable_tables.h"
#include "util/tape_memory.h"

namespace edgegrad {

// Points at which a texture program is evaluated; vectors are (count, 3).
struct TextureTask {
    int64_t count;
    const int32_t *program, *face, *ray_kind, *backside;
    const float *b1, *b2, *position, *normal, *true_normal, *view;
};

// BSDFs that are evaluated and sampled. `random` has (count) numbers each for lobe, u and v.
struct BsdfTask {
    int64_t count;
    const int32_t *kind, *flags;  // of materials
    const float* rows;            // (M, kMaterialParams)
    const int32_t *material, *from_inside;
    const float *normal, *true_normal, *tangent, *wo, *wi;
    const float* random[3];
    int32_t favoured = 0;  // bits of lobes; as for derivatives by roughness alone
};
struct BsdfResult {
    float *value, *pdf, *emission, *sample_wi, *sample_weight, *sample_pdf;
    int32_t *sample_active, *sample_specular, *sample_transmitted, *sample_ray_kind;
};

// Derivatives of a probe's values: reverse mode from `adjoint` to gradients of the tables or, if `adjoint` is
// null, forward mode from tangents of the tables to `tangent`. Both have one row per point.
struct ProbeSweep {
    const DifferentiableTables* tables;
    TapeMemory* memory;
    const float* adjoint;
    float* tangent;
};
// Of BSDFs: value and emission.
constexpr int kBsdfOutputs = 6;

// Parts of the shading code that read the scene (adjoint/scene_probes.h), for an array of points.
enum SceneProbeKind : int32_t {
    kSurfaceProbe,
    kBentNormalProbe,
    kCameraProbe,
    kEnvironmentProbe,
    kLightProbe,
    // Blocks (adjoint/block_probes.h):
    kMetPointProbe,
    kSegmentProbe,
    kReflectionProbe
};
constexpr int kSceneOutputs = 9;
struct SceneProbe {
    SceneProbeKind kind;
    int64_t count;
    const int32_t *index, *instance;  // face or row of the light table
    const float *a, *b;               // (count, 3)
    float* value;                     // (count, kSceneOutputs), or null
};

// Rays to trace, in columns of whole packets.
struct RayBatch {
    const float *origin[3], *direction[3], *far;
    int64_t count;
    bool shadow;  // find any hit; else the nearest hit
    bool coherent;
    bool brute_force;  // test all triangles; else choose as pictures do
};

}  // namespace edgegrad
