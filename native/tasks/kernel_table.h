// The kernels as the engine calls them: one table of functions for each instruction set.
#pragma once

#include <cstdint>

#include "tasks/adjoint_task.h"
#include "tasks/boundary_kind.h"
#include "tasks/boundary_task.h"
#include "tasks/edge_on_task.h"
#include "tasks/edge_weight_task.h"
#include "tasks/horizon_task.h"
#include "tasks/image_task.h"
#include "tasks/light_probe_task.h"
#include "tasks/probe_tasks.h"
#include "tasks/scan_task.h"
#include "tasks/splats.h"
#include "tasks/workspace_view.h"

namespace edgegrad {

// Estimators of one kind of boundary term: forward mode computes splats, reverse mode gradients.
struct BoundaryKernels {
    void (*forward)(const SceneView&, const BoundaryTask&, Workspace&, const DerivativeView& tangent,
                    Splats& splats);
    void (*backward)(const SceneView&, const BoundaryTask&, Workspace&, const float* adjoint,
                     DerivativeView& gradient);
};

struct WarpTask;  // reparameterisation/warp_task.h

struct KernelTable {
    const char* name;
    int width;
    void (*radiance)(const SceneView&, const ImageTask&, Workspace&, float* image);
    // Traces a task's paths and records their vertices for sweeps.
    void (*record)(const SceneView&, const ImageTask&, Workspace&);
    // Compacts the recorded vertices of `paths` paths.
    void (*close_up)(Workspace&, int32_t paths);
    // Multiplies recorded paths by their weight in the balance with samples by area, and records the latter.
    void (*weigh_edge_on)(const SceneView&, const EdgeOnFaces&, int32_t paths, bool by_area, Workspace&);
    void (*record_edge_on)(const SceneView&, const EdgeOnTask&, Workspace&);
    void (*path_backward)(const SceneView&, const AdjointTask&, const float* adjoint);
    void (*path_forward)(const SceneView&, const AdjointTask&, float* const radiance[3]);
    // The same for derivatives by colours and strengths alone.
    void (*record_values)(const SceneView&, const ImageTask&, Workspace&);
    void (*values_backward)(const SceneView&, const ValueTask&, const float* adjoint);
    void (*values_forward)(const SceneView&, const ValueTask&, float* const radiance[3]);
    // Adds the paths' values to the picture.
    void (*accumulate)(const ImageTask&, const Workspace&, float* image);
    BoundaryKernels boundary[kBoundaryKinds];
    // The warped picture, step by step (engine/terms/warp_term.cpp).
    void (*warp_record)(const SceneView&, const WarpTask&, Workspace&);
    void (*warp_borders)(const SceneView&, const WarpTask&, Workspace&);
    void (*warp_forward)(const SceneView&, const WarpTask&, Workspace&, const DerivativeView& tangent,
                         Splats& splats);
    void (*warp_backward)(const SceneView&, const WarpTask&, Workspace&, const float* adjoint,
                          DerivativeView& gradient);
    void (*edge_weights)(const SceneView&, const EdgeWeightTask&);
    // One place per sample, by which edges are weighted (boundary/samples/edge_reach.h).
    void (*seen_places)(const SceneView&, const BoundaryTask&, SeenPlaces&);
    void (*edge_reach)(const SceneView&, const EdgeReachTask&);
    // Forward mode: into the radiance of the task's paths.
    void (*horizon_forward)(const SceneView&, const HorizonTask&, Workspace&, const DerivativeView& tangent);
    void (*horizon_backward)(const SceneView&, const HorizonTask&, Workspace&, const float* adjoint,
                             DerivativeView& gradient);
    void (*add_splats)(const CameraView&, const Splats&, int64_t count, float* image);  // in their order
    // The specular boundary, step by step (engine/terms/specular_term.cpp).
    int (*scan)(const SceneView&, const ScanTask&, ChainCrossings&);
    void (*chain_sides)(const SceneView&, const BoundaryTask&, Workspace&, VertexMemory&, ChainCrossings&,
                        int count);
    void (*chain_sweeps)(const BoundaryTask&, ChainCrossings&, int count);
    void (*chain_forward)(const SceneView&, const ChainCrossings&, int count, Workspace&,
                          const DerivativeView& tangent, Splats& splats);
    void (*chain_backward)(const SceneView&, const ChainCrossings&, int count, const float* adjoint,
                           DerivativeView& gradient, float* seeds);
    // Boundaries in caustics (engine/terms/caustic_term.cpp); the rest as of the specular boundary.
    int (*caustics)(const SceneView&, const BoundaryTask&, ChainCrossings&);
    // One beam per sample, of the pilot that aims samples of edges.
    void (*light_beams)(const SceneView&, const BoundaryTask&, BeamPaths&);
    void (*weigh_caustics)(const SceneView&, const BoundaryTask&, ChainCrossings&, int count);
    void (*textures)(const SceneView&, const TextureTask&, float* rows);  // (count, kMaterialParams)
    void (*ray_batch)(const SceneView&, const RayBatch&, int32_t* face, float* distance);
    // Probes: single functions of the path tracer and their derivatives, for tests. Null in builds without
    // them.
    void (*bsdfs)(const BsdfTask&, const BsdfResult&);
    void (*texture_derivatives)(const SceneView&, const TextureTask&, const float* rows, const ProbeSweep&);
    void (*bsdf_derivatives)(const BsdfTask&, const ProbeSweep&);
    void (*scene_derivatives)(const SceneView&, const SceneProbe&, const ProbeSweep&);
    void (*light_samples)(const SceneView&, const LightProbes&);
    void (*light_directions)(const SceneView&, const DirectionProbes&);
    void (*environment)(const SceneView&, const EnvironmentProbes&);
};

}  // namespace edgegrad
