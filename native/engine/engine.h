// The engine: a scene's tables, its BVH, and the calls that run kernels over pictures and edges.
//
// Results are the same bits for any number of threads: every pixel is summed in the order of its
// samples, and gradients are summed in a number of groups that depends on the problem only, each by
// one thread at a time, then group by group.
#pragma once

#include <cstring>
#include <memory>
#include <mutex>
#include <optional>

#include "boundary/curves/edge_cache.h"
#include "boundary/meshes/solids.h"
#include "engine/derivative_tables.h"
#include "scene/lights/light_list.h"
#include "scene/rays/bvh.h"
#include "tasks/dropped_samples.h"
#include "tasks/kernel_table.h"
#include "tasks/render_options.h"
#include "util/object_pool.h"
#include "util/parallel.h"

namespace edgegrad {

struct FollowedAlpha;
class ThreadMemory;
struct ImagePlan;

// Samples that a term of a derivative leaves out, with the place of the first one.
struct DroppedTerm {
    const char* term;
    int64_t count;
    int64_t pixel;        // interior; else -1
    int32_t vertices[2];  // of the edge; -1: there is none
    int32_t faces[2];     // the surface or a face of the edge, and the one that pierces it; -1: there is none
};
using Dropped = std::vector<DroppedTerm>;

struct LearnedSampling;
class Decisions;
struct PictureFacts;
struct ParameterFloats;

class Engine {
 public:
    Engine(const embree::Api& api, const KernelTable& kernels, SceneTables tables, int threads);

    // Builds the BVH if there is none yet. Calls that trace rays build it as well; decisions do not need it.
    void build_bvh() const { bvh(); }
    bool has_bvh() const { return bvh_ != nullptr; }
    // Takes new values for the same topology, and refits the BVH of moved meshes. If this or move_vertices
    // fails, all other calls throw until an update succeeds.
    void update(SceneTables tables);
    // Takes other materials, lights, environment and camera, in equal numbers.
    void update_values(ValueTables values);
    // Takes other vertices (count, 3) of one mesh, and subtracts `origin`.
    void move_vertices(int32_t mesh, const double* vertices, size_t count, const double* origin);
    // Takes the edges of the visible meshes (core/geometry/topology.py). Derivatives need them, pictures do
    // not.
    void set_edges(std::vector<uint32_t> vertices, std::vector<uint32_t> face_first,
                   std::vector<uint32_t> faces, std::vector<uint32_t> opposite,
                   const std::vector<uint32_t>& collinear, std::vector<uint8_t> sharing,
                   const std::vector<uint32_t>& touching);
    // Concurrent calls must use the same camera: an equal camera is not written.
    void set_camera(const CameraView& camera) {
        if (std::memcmp(&tables_.camera, &camera, sizeof camera) != 0) tables_.camera = camera;
    }
    const SceneTables& tables() const { return tables_; }

    // Renders a (height, width, 3) picture. Returns the light that is left out.
    DroppedSamples render(const RenderOptions& options, const Progress& progress, float* image) const;
    // Adds the options' samples, from number `first` of each pixel on, to the sums (height, width, 3) of
    // those before, and sets the picture to the mean of all. It has the bits of one call of `render` for all
    // of them. The sums are useless after an exception.
    DroppedSamples add_samples(const RenderOptions& options, int32_t first, const Progress& progress,
                               double* sums, float* image) const;
    // Derivatives (engine/derivatives.cpp): forward mode along tangents of the tables, and gradients of the
    // requested tables for an adjoint picture. `dropped` receives the samples that are left out. `learned`,
    // if not null, contains sample weights from earlier gradients: both modes use it, and gradients add to
    // it.
    void forward(const RenderOptions& options, const Requested& requested, TableValues tangents,
                 LearnedSampling* learned, const Progress& progress, float* image, Dropped& dropped,
                 Decisions& decided) const;
    TableValues backward(const RenderOptions& options, const Requested& requested, const float* adjoint,
                         LearnedSampling* learned, const Progress& progress, Dropped& dropped,
                         Decisions& decided) const;
    // Decides what such a call computes, and what each of some parameters changes (`Decision::by_parameter`).
    // The call reuses the results of the searches that this needs.
    Decisions decide(const RenderOptions& options, const Requested& requested,
                     const ParameterFloats& parameters) const;

    // Returns the facts by which pictures skip work.
    PictureFacts picture_facts() const;

    // For tests of light sampling.
    void probe_lights(const LightProbes& probes) const;
    void probe_directions(const DirectionProbes& probes) const;
    void probe_environment(const EnvironmentProbes& probes) const;
    // For tests and measurements: rays by themselves, in columns of whole packets.
    void trace(const RayBatch& rays, int32_t* face, float* distance) const;

 private:
    struct DerivativeCall;
    template <typename F>
    bool place_vertices(int32_t mesh, const F& coordinate);
    void moved_geometry(const std::vector<int32_t>& moved, bool far,
                        const std::vector<Bvh::ChangedField>& fields);
    std::vector<Bvh::ChangedField> place_fields(const std::vector<FieldTable>& next, bool all);
    void take_values(ValueTables values);
    void require_settled() const;
    const Bvh& bvh() const;
    std::shared_ptr<const std::vector<SolidBody>> bodies() const;
    std::shared_ptr<const std::vector<float>> normals() const;
    void forget_shapes();
    bool is_convex_mesh(size_t mesh) const;
    std::vector<uint8_t> clear_emitters(const LightList& lights) const;
    bool hides_no_light() const;
    bool hides_no_surface() const;

    // Calls trace(scene, task, workspace) for each task of a picture. Returns the light that is left out.
    template <typename Trace>
    DroppedSamples trace_picture(const ImagePlan& plan, const Progress& progress, const Trace& trace) const;
    // Memory by thread, which the caller gives back.
    std::shared_ptr<std::vector<ThreadMemory>> thread_memory() const;

    const embree::Api& api_;
    const KernelTable& kernels_;
    SceneTables tables_;
    int threads_;
    // Computed at first use, and kept until values or vertices change.
    std::shared_ptr<const LightList> lights(bool dark_too = false) const;
    // Which lobes derivatives follow (engine/decisions/followed_lobes_rule.h).
    FollowedAlpha follow(const RequestedMotion& motion, const std::vector<int8_t>& sides,
                         const std::shared_ptr<const LightList>& lights) const;
    // The lights that derivatives sample.
    std::shared_ptr<const LightList> lights_for(const Requested& requested) const;
    mutable std::mutex made_lock_;
    mutable std::shared_ptr<const LightList> lights_, dark_lights_;
    // Computed at first use, and kept until vertices change.
    mutable std::shared_ptr<const std::vector<SolidBody>> bodies_;
    mutable std::shared_ptr<const std::vector<float>> normals_;
    mutable std::vector<std::optional<bool>> convex_;  // by mesh
    mutable std::optional<bool> apart_;                // whether the scene's two meshes are
    mutable EdgeCache kept_;
    mutable ZeroedPool zeroed_pool_;
    mutable ObjectPool<std::vector<ThreadMemory>> memory_pool_;
    mutable std::unique_ptr<Bvh> bvh_;
    bool settled_ = true;                        // the BVH and the caches belong to the current vertices
    mutable std::vector<float> built_vertices_;  // positions for which the BVH was built
    // Properties of the topology, known with the edges.
    std::vector<uint8_t> closed_;                         // by mesh
    mutable std::vector<std::optional<bool>> connected_;  // by mesh, computed at first use
};

}  // namespace edgegrad
