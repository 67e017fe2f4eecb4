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

class ThreadMemory;

// Samples that a term of a derivative leaves out, with where the first of them is.
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

class Engine {
 public:
    Engine(const embree::Api& api, const KernelTable& kernels, SceneTables tables, int threads);

    // Builds the BVH if there is none yet. Calls that trace rays do so too: decisions don't need it.
    void build_bvh() const { bvh(); }
    bool has_bvh() const { return bvh_ != nullptr; }
    // Takes new values for the same topology; the BVH is refitted where vertices moved. If this or
    // move_vertices fails, all other calls throw until an update has come to its end.
    void update(SceneTables tables);
    // Only other materials, lights, environment and camera, of the same numbers.
    void update_values(ValueTables values);
    // Only other vertices (count, 3) of one mesh, of which `origin` is subtracted.
    void move_vertices(int32_t mesh, const double* vertices, size_t count, const double* origin);
    // Edges of the visible meshes (core/geometry/topology.py): derivatives need them, pictures don't.
    void set_edges(std::vector<uint32_t> vertices, std::vector<uint32_t> face_first,
                   std::vector<uint32_t> faces, std::vector<uint32_t> opposite);
    // Calls at the same time may only differ in their options: with one camera this writes nothing.
    void set_camera(const CameraView& camera) {
        if (std::memcmp(&tables_.camera, &camera, sizeof camera) != 0) tables_.camera = camera;
    }
    const SceneTables& tables() const { return tables_; }

    // Pictures are (height, width, 3). Returns the light that they leave out.
    DroppedSamples render(const RenderOptions& options, const Progress& progress, float* image) const;
    // Derivatives (engine/derivatives.cpp): of the picture along tangents of the tables, and gradients of the
    // wanted tables for an adjoint picture. What they leave out is told in `dropped`. `learned`, if not null,
    // is what earlier gradients have learned of the samples' worth: both take samples by it, and a gradient
    // adds its own.
    void forward(const RenderOptions& options, const Requested& requested, TableValues tangents,
                 LearnedSampling* learned, const Progress& progress, float* image, Dropped& dropped,
                 Decisions& decided) const;
    TableValues backward(const RenderOptions& options, const Requested& requested, const float* adjoint,
                         LearnedSampling* learned, const Progress& progress, Dropped& dropped,
                         Decisions& decided) const;
    // What such a call would compute. What is looked for to know that is kept for the call.
    Decisions decide(const RenderOptions& options, const Requested& requested) const;

    // For tests: light sampling by itself.
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

    // By thread; to be given back.
    std::shared_ptr<std::vector<ThreadMemory>> thread_memory() const;

    const embree::Api& api_;
    const KernelTable& kernels_;
    SceneTables tables_;
    int threads_;
    // Made when a call first asks for them, and kept until values or vertices change.
    std::shared_ptr<const LightList> lights(bool dark_too = false) const;
    // The alpha up to which derivatives follow lobes (engine/decisions/followed_lobes_rule.h).
    float follow(const RequestedMotion& motion, const std::vector<int8_t>& sides,
                 const std::shared_ptr<const LightList>& lights) const;
    // Those that derivatives sample.
    std::shared_ptr<const LightList> lights_for(const Requested& requested) const;
    mutable std::mutex made_lock_;
    mutable std::shared_ptr<const LightList> lights_, dark_lights_;
    // The same, until vertices change.
    mutable std::shared_ptr<const std::vector<SolidBody>> bodies_;
    mutable std::shared_ptr<const std::vector<float>> normals_;
    mutable std::vector<std::optional<bool>> convex_;  // by mesh
    mutable std::optional<bool> apart_;                // the scene's two
    mutable EdgeCache kept_;
    mutable ZeroedPool zeroed_pool_;
    mutable ObjectPool<std::vector<ThreadMemory>> memory_pool_;
    mutable std::unique_ptr<Bvh> bvh_;
    bool settled_ = true;                        // the BVH and what is kept are those of the vertices
    mutable std::vector<float> built_vertices_;  // where they were when the BVH was built from scratch
    // What the topology alone says, once the edges are known.
    std::vector<uint8_t> closed_;                         // by mesh
    mutable std::vector<std::optional<bool>> connected_;  // by mesh, once it is asked for
};

}  // namespace edgegrad
