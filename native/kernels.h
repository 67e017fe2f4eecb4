// The kernels as the engine calls them: one table of functions per instruction set.
#pragma once

#include <cstdint>

#include "adjoint/memory.h"
#include "adjoint/tables.h"
#include "boundary/edge_mass_task.h"
#include "boundary/scan_task.h"
#include "light_probes.h"
#include "path/value_packet.h"
#include "path/vertex_packet.h"
#include "scene/view.h"

namespace edgegrad {

// Paths of one task: enough for compaction to pay, few enough for the cache.
constexpr int kBlockPaths = 8192;
// Of those whose vertices are recorded.
constexpr int kRecordedPaths = 1024;
// Of those that are followed to horizons (boundary/horizon.h).
constexpr int kHorizonPaths = 2048;
constexpr int kMaxWidth = 16;

// Live paths of a task, one array for each value (path/path_queue.h).
struct PathQueue {
    float *origin[3], *direction[3], *throughput[3], *from[3], *from_normal[3], *pdf;
    int32_t *path, *state, *bounces, *from_mesh;
};

// What the rays of a queue met; face -1: nothing.
struct HitQueue {
    int32_t *face, *mesh, *instance;
    float *b1, *b2, *distance;
    const struct EdgeStarts* edges;  // of first hits beside edges; else null
};

// First hits beside edges, one array for each value.
struct EdgeStarts {
    float* aside[3];  // from there to where rays leave
    int32_t* other;   // the face on the other side, whose radiance is taken off; -1: none
    float *b1, *b2;   // the hit on it
};

// Scratch memory of one thread.
struct Workspace {
    float* radiance[3];  // by path: L, or its derivative in forward mode
    PathQueue paths;
    HitQueue hits;
    // Where vertices are recorded for derivatives, or what those by colours and strengths need; null: they
    // are not.
    VertexMemory* vertices;
    ValueMemory* values;
    CameraSamples camera;
    int32_t* visible;      // by path (path/touched_vertices.h): whether it counts
    EdgeStarts edges;      // memory of hits.edges
    TapeBuffer* segments;  // of a boundary task (boundary/segment.h), in packets
};

// Most scatterings of each kind; a ray beyond them brings light but isn't scattered again.
struct BounceLimits {
    int32_t diffuse = 255, glossy = 255, transmission = 255, transparent = 255;
};

// A run of pixels with some of their samples: pixel_count * samples <= kBlockPaths.
struct ImageTask {
    int32_t first_pixel, pixel_count;
    int32_t first_sample, samples;  // sample indices within each pixel
    int32_t max_depth;
    uint32_t seed;
    float weight;  // 1 / samples per pixel
    int32_t skipped_row,
        skipped_all;      // pixels of the full picture left out per row, and before the window's first
    int32_t row, column;  // of the first pixel in the window
    int32_t width;        // of the window
    BounceLimits limits;
    bool one_stream;  // all pixels have the random numbers of the first: the two sides of edges
    // Not negative: pixels that are close together share a sequence (path/stream.h), of which each takes so
    // many bits of numbers.
    int32_t sample_bits = -1;
};

// Samples of a derivative that are left out because they have no finite value: how many, and the first.
struct DroppedSamples {
    int64_t count = 0, first = INT64_MAX;
    int32_t place = -1, instance = -1;  // of the first: its edge, or (interior) face
};

// The recorded vertices of a task's paths, and what sweeps over them need.
struct AdjointTask {
    const ImageTask* image;
    VertexMemory* vertices;
    CameraSamples camera;
    TapeMemory* tape;
    const DifferentiableTables* tables;
    bool geometry;      // whether positions, directions or normals change
    bool camera_moves;  // whether camera rays do
    DroppedSamples* dropped;
    // By path, what sweeps carry from vertex to vertex: light, the vertex that it comes from, and the
    // derivatives of the vertex' position and of a specular ray's direction.
    float* incoming[3];
    int32_t* next;
    float *position[3], *direction[3];
    // Those of the paths' last vertices are given: a backward sweep starts from them (boundary/specular.h).
    bool seeded;
};

// The same of what derivatives by colours and strengths need.
struct ValueTask {
    const ImageTask* image;
    ValueMemory* values;
    const DifferentiableTables* tables;
    DroppedSamples* dropped;
    float* incoming[3];
};

// Kinds of boundary terms.
enum BoundaryKind : int32_t {
    kPrimaryBoundary,   // what the camera sees (boundary/primary.h)
    kShadowBoundary,    // between a surface and a light (boundary/shadow.h)
    kSkyBoundary,       // between a surface and the environment
    kIndirectBoundary,  // between two surfaces (boundary/indirect.h)
    kAimedBoundary,     // the same, where the camera sees it in sharp lobes (boundary/aimed.h)
    kPiercedLight,      // where surfaces pass through what gives light (boundary/pierced.h)
    kPiercedSurface,    // through what scatters it
    kConeBorder,        // where spots without blend end (boundary/cone_border.h)
    kLightOutline,      // of lights that the camera sees (boundary/light_outline.h)
    kEmitterOutline,    // of emissive meshes that surfaces see (boundary/emitter_outline.h)
    kPiercedOutline,    // of lights that meshes pass through (boundary/pierced_outline.h)
    kPiercedDisk,       // where surfaces pass through lights that face x (boundary/pierced_disk.h)
    kBoundaryKinds
};
// The term that each belongs to (core/renderer.py).
constexpr const char* kBoundaryTerms[] = {"primary",  "shadow", "shadow",  "indirect", "indirect", "shadow",
                                          "indirect", "shadow", "primary", "shadow",   "primary",  "shadow"};
static_assert(sizeof kBoundaryTerms / sizeof *kBoundaryTerms == kBoundaryKinds);

// Pieces of edges as rows of floats, and nodes over them (boundary/edge_tree.h).
enum EdgePieceColumn : int32_t {
    kPieceFrom = 0,   // the whole edge: its first end,
    kPieceAlong = 3,  // and from it to the second
    kPieceNormal =
        6,  // of two faces, so that the edge is a silhouette where their signs differ; 0: from all sides
    kPieceU0 = 12,
    kPieceU1 = 13,
    kPieceEdge = 14,  // integers
    kPieceInstance = 15,
    kPieceColumns = 16
};
constexpr int32_t kMostTopNodes = 24;
struct EdgeTreeView {
    const LightNode* nodes;
    const int32_t* top;  // numbers of nodes of which one is picked first
    int32_t top_count;
    const float* pieces;  // (count, kPieceColumns)
};

// Flag of a piece's cell: of segments that the camera sees by way of other surfaces.
constexpr int32_t kChained = 1 << 30;

// What becomes of a term's samples, for what later calls learn from them
// (boundary/learned_masses.h): what the sample is worth, the expected number of samples on its piece, which
// piece that is (the entry of the list that it belongs to, and its cell), and where on the edge.
struct SampleRecord {
    int32_t shift;               // of 2^shift samples one is recorded
    float *worth, *density, *u;  // null: nothing is learned
    int32_t *entry, *cell;       // of the list of pieces; its direction cell

    // Whether sample `number` is recorded, and where.
    bool has(int64_t number) const { return worth && (number & ((int64_t{1} << shift) - 1)) == 0; }
    int64_t place(int64_t number) const { return number >> shift; }
};

// Pieces of candidate edges (boundary/candidates.h), and samples [first, first + count) of `total`
// systematic ones over their summed mass.
struct BoundaryTask {
    const int32_t* edge;
    const int32_t* instance;  // -1: none; null: none has one
    const float* u0;
    const float* u1;
    // Of direction_cells^2 directions about the edge (cosines, and azimuths), or, of samples that start at
    // the camera, of as many cells of the picture; and kChained. Null: none. Of kConeBorder and kLightOutline
    // instead of an edge the light, in turns about which u0 and u1 are.
    const int32_t* cell;
    int32_t direction_cells;
    const int32_t* parts;      // null: every entry is one piece (boundary/candidates.h)
    const double* cumulative;  // (entries + 1) mass
    int64_t entries;
    int64_t first, count, total;
    int32_t max_depth;
    uint32_t seed;
    BoundaryKind kind;
    BounceLimits limits;
    // The mass cut into equal shares, and how much of the samples goes to those before each (shares + 1);
    // null: to all alike. What samples count for is scaled by `scale`; `score`, if not null, takes the size
    // of each one.
    const double* guide;
    int64_t shares;
    float scale;
    float* score;
    // Lobes of an alpha up to this, where the camera sees them, are the aimed estimator's, with the edges of
    // the tree; from kAimAtAll on all light is.
    float aimed;
    EdgeTreeView tree;
    SampleRecord record;
    DroppedSamples* dropped;
};
constexpr float kAimAtAll = 1e3f;
// The gloss over a diffuse base is weak, and worth it only where it is sharper by this.
constexpr float kWeakGloss = 0.25f;

// Camera samples by the area of faces that are seen edge-on (path/edge_on_task.h).
struct EdgeOnFaces;
struct EdgeOnTask;

// Paths of the picture at whose vertices the faces' own planes cut off light (boundary/horizon.h).
struct HorizonTask {
    ImageTask image;
    bool lights, surfaces;  // of lights and the environment; that surfaces scatter
    DroppedSamples* dropped;
};

// Forward mode: one value per boundary sample, at a place of the picture (x below kNowhere: at none).
constexpr float kNowhere = -1e9f;
struct Splats {
    float *x, *y;
    float* value[3];
};

// Points to evaluate a texture program at, one after the other; vectors are (count, 3).
struct TextureTask {
    int64_t count;
    const int32_t *program, *face, *ray_kind, *backside;
    const float *b1, *b2, *position, *normal, *true_normal, *view;
};

// BSDFs to evaluate and sample, one after the other; `random` has (count) numbers each for lobe, u and v.
struct BsdfTask {
    int64_t count;
    const int32_t *kind, *flags;  // of materials
    const float* rows;            // (M, kMaterialParams)
    const int32_t *material, *from_inside;
    const float *normal, *true_normal, *tangent, *wo, *wi;
    const float* random[3];
    int32_t favoured = 0;  // lobes (bits), as for the last rays of derivatives by how wide they are
};
struct BsdfResult {
    float *value, *pdf, *emission, *sample_wi, *sample_weight, *sample_pdf;
    int32_t *sample_active, *sample_specular, *sample_transmitted, *sample_ray_kind;
};

// Derivatives of what a probe computes: backward from `adjoint` to the tables' gradients, or where that is
// null, forward from the tables' tangents to `tangent`. Both have one row per point.
struct ProbeSweep {
    const DifferentiableTables* tables;
    TapeMemory* memory;
    const float* adjoint;
    float* tangent;
};
// Of BSDFs: value and emission.
constexpr int kBsdfOutputs = 6;

// Parts of the shading code that read the scene (adjoint/scene_probes.h), for points one after the other.
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

// Rays to trace by themselves, in columns of whole packets.
struct RayBatch {
    const float *origin[3], *direction[3], *far;
    int64_t count;
    bool shadow;  // whether something is hit, else the nearest hit
    bool coherent;
    bool brute_force;  // all triangles, whatever their number, else as pictures do
};

// Estimators of one kind of boundary term: values of samples at places of the picture, and gradients.
struct BoundaryKernels {
    void (*forward)(const SceneView&, const BoundaryTask&, Workspace&, const DerivativeView& tangent,
                    Splats& splats);
    void (*backward)(const SceneView&, const BoundaryTask&, Workspace&, const float* adjoint,
                     DerivativeView& gradient);
};

struct KernelTable {
    const char* name;
    int width;
    void (*radiance)(const SceneView&, const ImageTask&, Workspace&, float* image);
    // Renders a task's paths and records their vertices, for:
    void (*record)(const SceneView&, const ImageTask&, Workspace&);
    // Weighs so many recorded paths against those by area, and records the latter, already weighed.
    void (*close_up)(Workspace&, int32_t paths);
    void (*weigh_edge_on)(const SceneView&, const EdgeOnFaces&, int32_t paths, bool by_area, Workspace&);
    void (*record_edge_on)(const SceneView&, const EdgeOnTask&, Workspace&);
    void (*path_backward)(const SceneView&, const AdjointTask&, const float* adjoint);
    void (*path_forward)(const SceneView&, const AdjointTask&, float* const radiance[3]);
    // The same for derivatives by colours and strengths, where nothing moves.
    void (*record_values)(const SceneView&, const ImageTask&, Workspace&);
    void (*values_backward)(const SceneView&, const ValueTask&, const float* adjoint);
    void (*values_forward)(const SceneView&, const ValueTask&, float* const radiance[3]);
    // Adds the paths' values to the picture.
    void (*accumulate)(const ImageTask&, const Workspace&, float* image);
    BoundaryKernels boundary[kBoundaryKinds];
    void (*edge_masses)(const SceneView&, const EdgeMassTask&);
    // Forward mode: into the radiance of the task's paths.
    void (*horizon_forward)(const SceneView&, const HorizonTask&, Workspace&, const DerivativeView& tangent);
    void (*horizon_backward)(const SceneView&, const HorizonTask&, Workspace&, const float* adjoint,
                             DerivativeView& gradient);
    void (*add_splats)(const CameraView&, const Splats&, int64_t count, float* image);  // in their order
    // The specular boundary, step by step (specular_term.cpp).
    int (*scan)(const SceneView&, const ScanTask&, const BounceLimits&, int32_t max_depth, ChainCrossings&);
    void (*chain_sides)(const SceneView&, const BoundaryTask&, Workspace&, VertexMemory&, ChainCrossings&,
                        int count);
    void (*chain_sweeps)(const BoundaryTask&, ChainCrossings&, int count);
    void (*chain_forward)(const SceneView&, const ChainCrossings&, int count, Workspace&,
                          const DerivativeView& tangent, Splats& splats);
    void (*chain_backward)(const SceneView&, const ChainCrossings&, int count, const float* adjoint,
                           DerivativeView& gradient, float* seeds);
    void (*textures)(const SceneView&, const TextureTask&, float* rows);  // (count, kMaterialParams)
    void (*bsdfs)(const BsdfTask&, const BsdfResult&);
    void (*texture_derivatives)(const SceneView&, const TextureTask&, const float* rows, const ProbeSweep&);
    void (*bsdf_derivatives)(const BsdfTask&, const ProbeSweep&);
    void (*scene_derivatives)(const SceneView&, const SceneProbe&, const ProbeSweep&);
    void (*light_samples)(const SceneView&, const LightProbes&);
    void (*light_directions)(const SceneView&, const DirectionProbes&);
    void (*sky)(const SceneView&, const SkyProbes&);
    void (*ray_batch)(const SceneView&, const RayBatch&, int32_t* face, float* distance);
};

}  // namespace edgegrad
