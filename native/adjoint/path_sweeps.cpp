// Sweeps over the recorded vertices of a task's paths. Gradients run from the ends of the paths to the
// camera, the derivative along a tangent runs from the camera to the ends.
#include "adjoint/number.h"

#include "adjoint/adjoint_kernels.h"
#include "adjoint/vertex.h"
#include "tasks/adjoint_task.h"
#include "tasks/kernel_table.h"

namespace edgegrad::EDGEGRAD_ISA {

namespace {

EG_INLINE RawVec3 gather_raw3(float* const (&base)[3], Int at) {
    return {raw::gather(base[0], at), raw::gather(base[1], at), raw::gather(base[2], at)};
}
EG_INLINE void scatter3(float* const (&base)[3], Int at, Mask m, raw::Float x, raw::Float y, raw::Float z) {
    raw::scatter(base[0], at, m, x), raw::scatter(base[1], at, m, y), raw::scatter(base[2], at, m, z);
}

// The rays that found a packet's vertices. Positions of previous vertices and directions of specular rays are
// inputs of a vertex. Their derivatives are passed from vertex to vertex, by path.
struct ArrivalInputs {
    Arrival arrival;
    Vec3 from, direction;
};

EG_INLINE Vec3 input_of(Vec3 a) { return {input(a.x.value), input(a.y.value), input(a.z.value)}; }

ArrivalInputs arrive(const SceneView& scene, const AdjointTask& task, const Vertex& v) {
    ArrivalInputs in;
    in.from = load3(v.from), in.direction = load3(v.direction);
    if (task.geometry) in.from = input_of(in.from), in.direction = input_of(in.direction);
    in.arrival = {in.from, in.direction};
    if (!task.camera_moves) return in;
    const Mask camera = load(v.active) & (load(v.kind) == static_cast<int>(kCameraRay));
    if (!any(camera)) return in;
    const Int path = select(camera, load(v.path), splat(0));
    const auto sample = [&](const float* values) {
        return EDGEGRAD_ISA::constant(raw::gather(values, path));
    };
    const CameraRay ray = camera_ray(scene.camera, sample(task.camera.x), sample(task.camera.y),
                                     sample(task.camera.lens_u), sample(task.camera.lens_v));
    in.arrival = {select(camera, ray.origin, in.from), select(camera, ray.direction, in.direction)};
    return in;
}

Mask finite(Vec3 a) {
    const auto one = [](Float x) { return x.value - x.value == 0.0f; };
    return one(a.x) & one(a.y) & one(a.z);
}

// Clears the derivatives by a vertex' position and direction, so that later vertices have none by earlier
// ones.
void forget_place(const AdjointTask& task, Mask m, Int path) {
    const raw::Float zero = raw::splat(0.0f);
    scatter3(task.position, path, m, zero, zero, zero);
    scatter3(task.direction, path, m, zero, zero, zero);
}

// Counts vertices whose contribution is left out.
EG_OUTLINE void count_dropped(const AdjointTask& task, const Vertex& v, Mask lost, Int path) {
    for (int i = 0; i < W; ++i)
        if (lost[i])
            task.dropped->add(task.image->pixel_of(path[i]), v.face[i] < 0 ? -1 : v.face[i], v.instance[i]);
}

// Drops vertices whose light is not finite, with their contribution to the previous vertices.
EG_OUTLINE void drop(const AdjointTask& task, Vertex& v, Mask lost, Int path) {
    store(v.lost, lost);
    store(v.active, load(v.active) & ~lost);
    forget_place(task, lost, path);
    count_dropped(task, v, lost, path);
}

// Number of floats from one packet's field to the same field of the next packet.
constexpr int32_t kPacketFloats = static_cast<int32_t>(sizeof(Vertex) / sizeof(float));

// Evaluates all vertices from the ends of the paths to the camera, and calls `after` with the result of each
// packet. The tape holds one packet at a time, or with kKeep all packets as parts.
template <bool kKeep = false, typename After>
void walk_back(const SceneView& scene, const AdjointTask& task, Tape& tape, const After& after) {
    const int paths = task.image->pixel_count * task.image->samples;
    for (int k = 0; k < paths; ++k) {
        for (float* p : task.incoming) p[k] = 0.0f;
        task.next[k] = -1;
    }
    for (int64_t k = task.vertices->count - 1; k >= 0; --k) {
        Vertex& v = task.vertices->at<W>(k);
        if constexpr (kKeep)
            tape.new_part();
        else
            tape.clear();
        // Evaluate the vertices with the light that their successors have left
        Mask active = load(v.active), scattered = active & ~load(v.passes);
        const Int path = select(active, load(v.path), splat(0));
        const RawVec3 incoming = gather_raw3(task.incoming, path);
        const Int next = raw::gather(task.next, path);
        const ArrivalInputs in = arrive(scene, task, v);
        Leaving out =
            leave_vertex(scene, *task.vertices, v, in.arrival, constant3(incoming), next, task.geometry);
        // Drop vertices whose light is not finite
        const Mask lost = active & ~(finite(out.light) & finite(load3(v.throughput)));
        if (any(lost)) {
            drop(task, v, lost, path);
            active &= ~lost;
            scattered &= ~lost;
            out.light = select(lost, zero3(), out.light);
        }
        // Pass the light to the previous vertices
        scatter3(task.incoming, path, active | lost, out.light.x.value, out.light.y.value, out.light.z.value);
        raw::scatter(task.next, path, scattered, raw::lane_index() + static_cast<int32_t>(k) * kPacketFloats);
        after(v, active, path, in, out);
    }
}

EG_INLINE void seed3(Tape& tape, const Nodes3& to, Mask m, const RawVec3& value) {
    tape.seed(to.x, raw::select(m, value.x, 0.0f));
    tape.seed(to.y, raw::select(m, value.y, 0.0f));
    tape.seed(to.z, raw::select(m, value.z, 0.0f));
}

EG_INLINE RawVec3 derivatives(const Tape& tape, const Nodes3& of) {
    return {tape.derivative(of.x), tape.derivative(of.y), tape.derivative(of.z)};
}

void path_backward_kernel(const SceneView& scene, const AdjointTask& task, const float* adjoint) {
    const int paths = task.image->pixel_count * task.image->samples;
    for (int k = 0; k < paths && !task.seeded; ++k)
        for (int c = 0; c < 3; ++c) task.position[c][k] = task.direction[c][k] = 0.0f;
    Tape tape(*task.tape, *task.tables);
    walk_back(scene, task, tape,
              [&](Vertex& v, Mask active, Int path, const ArrivalInputs& in, const Leaving& out) {
                  // Seed with the adjoint of the pixel times the throughput
                  const Int pixel = 3 * (quotient(path, task.image->samples) + task.image->first_pixel);
                  const raw::Float share = raw::splat(task.image->weight);
                  const auto weight_of = [&](int c) {
                      return raw::gather(adjoint + c, pixel) * (raw::load(v.throughput[c]) * share);
                  };
                  const RawVec3 weight{weight_of(0), weight_of(1), weight_of(2)};
                  seed3(tape, nodes(out.light), active, weight);
                  const Mask scattered = active & ~load(v.passes);
                  // Seed with the adjoints that the next vertices have passed on
                  if (task.geometry) {
                      seed3(tape, nodes(out.position), scattered, gather_raw3(task.position, path));
                      seed3(tape, nodes(out.direction), scattered & load(v.specular),
                            gather_raw3(task.direction, path));
                  }
                  // Sweep, and pass the adjoints to the previous vertices
                  const Mask lost = active & tape.backward();
                  if (any(lost)) count_dropped(task, v, lost, path);
                  if (!task.geometry) return;
                  RawVec3 position = derivatives(tape, nodes(in.from)),
                          direction = derivatives(tape, nodes(in.direction));
                  const Mask passes = active & load(v.passes);
                  if (any(passes)) {
                      // A ray through a transparent surface is also the ray of the vertex behind it.
                      position = position + select(passes, gather_raw3(task.position, path), raw_zero3());
                      direction = direction + select(passes, gather_raw3(task.direction, path), raw_zero3());
                  }
                  scatter3(task.position, path, active, position.x, position.y, position.z);
                  scatter3(task.direction, path, active, direction.x, direction.y, direction.z);
              });
}

// Adds the derivative of a packet's vertices to the radiance of their paths, where it is finite.
EG_INLINE void add_change(const AdjointTask& task, const Tape& tape, const Vertex& v, Mask active, Int path,
                          const Nodes3& light, float* const radiance[3]) {
    const int32_t node[3] = {light.x, light.y, light.z};
    raw::Float change[3];
    Mask finite = active;
    for (int c = 0; c < 3; ++c) {
        change[c] = raw::load(v.throughput[c]) * tape.derivative(node[c]);
        finite &= change[c] - change[c] == 0.0f;
    }
    for (int c = 0; c < 3; ++c)
        raw::scatter(radiance[c], path, finite, raw::gather(radiance[c], path) + change[c]);
    if (const Mask lost = active & ~finite; any(lost)) count_dropped(task, v, lost, path);
}

// One packet's part of a tape, and the nodes through which derivatives enter and leave it.
struct Part {
    Tape::Place first, last;
    int32_t nodes;
    Nodes3 from, direction;                  // inputs
    Nodes3 light, position, next_direction;  // outputs
};

// Records all vertices from the ends of the paths to the camera. Returns the parts by packet.
const Part* record_parts(const SceneView& scene, const AdjointTask& task, Tape& tape) {
    TapeBuffer& memory = task.tape->parts;
    memory.grow(static_cast<size_t>(task.vertices->count) * sizeof(Part), 0);
    Part* const parts = static_cast<Part*>(memory.data());
    Part* next = parts + task.vertices->count;
    Tape::Place place;
    walk_back<true>(scene, task, tape,
                    [&](const Vertex&, Mask, Int, const ArrivalInputs& in, const Leaving& out) {
                        const Tape::Place last = tape.place();
                        *--next = {place,
                                   last,
                                   tape.node_count(),
                                   nodes(in.from),
                                   nodes(in.direction),
                                   nodes(out.light),
                                   nodes(out.position),
                                   nodes(out.direction)};
                        place = last;
                    });
    return parts;
}

void path_forward_kernel(const SceneView& scene, const AdjointTask& task, float* const radiance[3]) {
    const int paths = task.image->pixel_count * task.image->samples;
    for (int k = 0; k < paths; ++k)
        for (int c = 0; c < 3; ++c) radiance[c][k] = task.position[c][k] = task.direction[c][k] = 0.0f;
    if (!task.geometry) {
        // No derivatives pass between vertices, so the order does not matter.
        Tape tape(*task.tape, *task.tables);
        return walk_back(scene, task, tape,
                         [&](Vertex& v, Mask active, Int path, const ArrivalInputs&, const Leaving& out) {
                             tape.forward();
                             add_change(task, tape, v, active, path, nodes(out.light), radiance);
                         });
    }
    // Light is known from the ends of the paths, motion from the camera. So record backwards first, then
    // sweep forwards.
    Tape tape(*task.tape, *task.tables);
    const Part* const parts = record_parts(scene, task, tape);
    for (int64_t k = 0; k < task.vertices->count; ++k) {
        const Vertex& v = task.vertices->at<W>(k);
        const Part& part = parts[k];
        // Seed with the motion of the previous vertices
        tape.reopen(part.first, part.last, part.nodes);
        const Mask active = load(v.active), scattered = active & ~load(v.passes), lost = load(v.lost);
        if (any(lost)) forget_place(task, lost, load(v.path));
        const Int path = select(active, load(v.path), splat(0));
        seed3(tape, part.from, active, gather_raw3(task.position, path));
        seed3(tape, part.direction, active & load(v.screen_form), gather_raw3(task.direction, path));
        // Sweep, and pass the motion to the next vertices
        tape.forward();
        add_change(task, tape, v, active, path, part.light, radiance);
        const auto hand_on = [&](float* const(&to)[3], Mask m, const Nodes3& of) {
            const RawVec3 d = derivatives(tape, of);
            scatter3(to, path, m, d.x, d.y, d.z);
        };
        hand_on(task.position, scattered, part.position);
        hand_on(task.direction, scattered & load(v.specular), part.next_direction);
    }
}

}  // namespace

void add_adjoint_path_kernels(KernelTable& table) {
    table.path_backward = path_backward_kernel;
    table.path_forward = path_forward_kernel;
}

}  // namespace edgegrad::EDGEGRAD_ISA
