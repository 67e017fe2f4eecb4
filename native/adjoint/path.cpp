// Sweeps over the recorded vertices of a task's paths: from their ends to the camera for gradients, and the
// other way round for the derivative along a tangent.
#include "adjoint/number.h"

#include "adjoint/vertex.h"
#include "kernels/parts.h"

namespace edgegrad::EDGEGRAD_ISA {

namespace {

struct RawVec3 {
    raw::Float x, y, z;
};

EG_INLINE RawVec3 gather_raw3(float* const (&base)[3], Int at) {
    return {raw::gather(base[0], at), raw::gather(base[1], at), raw::gather(base[2], at)};
}
EG_INLINE Vec3 constant3(const RawVec3& a) { return {constant(a.x), constant(a.y), constant(a.z)}; }

EG_INLINE void scatter3(float* const (&base)[3], Int at, Mask m, raw::Float x, raw::Float y, raw::Float z) {
    for (int i = 0; i < W; ++i)
        if (m[i]) base[0][at[i]] = x[i], base[1][at[i]] = y[i], base[2][at[i]] = z[i];
}

// What a packet's vertices were found by. Positions of earlier vertices, and directions of specular rays, are
// inputs of this vertex: their derivatives go by path from vertex to vertex.
struct ArrivalInputs {
    Arrival arrival;
    Vec3 from, direction;
};

// Whether it matters where rays start: for what moves, and for lights that rays meet on their way.
EG_INLINE bool looks_back(const SceneView& scene, const AdjointTask& task) {
    return task.geometry || scene.lights.sized_count + scene.lights.sized_distant > 0;
}

EG_INLINE Vec3 input_of(Vec3 a) { return {input(a.x.value), input(a.y.value), input(a.z.value)}; }

ArrivalInputs arrive(const SceneView& scene, const AdjointTask& task, const Vertex& v) {
    ArrivalInputs in;
    if (!looks_back(scene, task)) {
        in.direction = load3(v.direction);
        in.from = zero3();
        in.arrival = {in.from, in.direction};
        return in;
    }
    const Mask active = load(v.active);
    const Int path = load(v.path), previous = load(v.previous);
    const Mask camera = active & (previous < 0);
    Vec3 direction = load3(v.direction);
    RawVec3 place{raw::splat(0.0f), raw::splat(0.0f), raw::splat(0.0f)};
    for (int i = 0; i < W; ++i) {
        if (!active[i] || previous[i] < 0) continue;
        const Vertex& p = task.vertices->at<W>(previous[i] / W);
        const int lane = previous[i] % W;
        place.x[i] = p.position[0][lane], place.y[i] = p.position[1][lane], place.z[i] = p.position[2][lane];
    }
    Vec3 from = constant3(place);
    if (task.geometry) {
        from = input_of(from);
        direction = input_of(direction);
    }
    in.from = from;
    in.direction = direction;
    if (any(camera)) {
        const auto sample = [&](const float* values) {
            return EDGEGRAD_ISA::constant(raw::gather(values, raw::select(camera, path, raw::splat(0))));
        };
        const CameraRay ray = camera_ray(scene.camera, sample(task.camera.x), sample(task.camera.y),
                                         sample(task.camera.lens_u), sample(task.camera.lens_v));
        from = select(camera, ray.origin, from);
        direction = select(camera, ray.direction, direction);
    }
    in.arrival = {from, direction};
    return in;
}

Mask finite(Vec3 a) {
    const auto one = [](Float x) { return x.value - x.value == 0.0f; };
    return one(a.x) & one(a.y) & one(a.z);
}

// A vertex of no position and direction: what is behind it has no derivatives by those before it.
void forget_place(const AdjointTask& task, Mask m, Int path) {
    const raw::Float zero = raw::splat(0.0f);
    scatter3(task.position, path, m, zero, zero, zero);
    scatter3(task.direction, path, m, zero, zero, zero);
}

// Leaves out vertices whose light is no finite number, with what they bring to the vertices before, and
// counts them.
EG_OUTLINE void drop(const AdjointTask& task, Vertex& v, Mask lost, Int path) {
    store(v.lost, lost);
    store(v.active, load(v.active) & ~lost);
    forget_place(task, lost, path);
    DroppedSamples& d = *task.dropped;
    for (int i = 0; i < W; ++i) {
        if (!lost[i]) continue;
        ++d.count;
        const int64_t pixel = task.image->first_pixel + path[i] / task.image->samples;
        if (pixel >= d.first) continue;
        d.first = pixel, d.place = v.face[i], d.instance = v.instance[i];
    }
}

// Goes over all vertices from the ends of paths; `after` runs on what each packet's evaluation gave.
template <typename After>
void walk_back(const SceneView& scene, const AdjointTask& task, Tape& tape, const After& after) {
    const int paths = task.image->pixel_count * task.image->samples;
    for (int k = 0; k < paths; ++k) {
        for (float* p : task.incoming) p[k] = 0.0f;
        task.next[k] = -1;
    }
    for (int64_t k = task.vertices->count - 1; k >= 0; --k) {
        Vertex& v = task.vertices->at<W>(k);
        tape.clear();
        Mask active = load(v.active), scattered = active & ~load(v.passes);
        const Int path = select(active, load(v.path), splat(0));
        const RawVec3 incoming = gather_raw3(task.incoming, path);
        const Int next = raw::gather(task.next, path);
        store(v.incoming[0], constant(incoming.x)), store(v.incoming[1], constant(incoming.y));
        store(v.incoming[2], constant(incoming.z));
        store(v.next, next);
        const ArrivalInputs in = arrive(scene, task, v);
        Leaving out =
            leave_vertex(scene, *task.vertices, v, in.arrival, constant3(incoming), next, task.geometry);
        const Mask lost = active & ~(finite(out.light) & finite(load3(v.throughput)));
        if (any(lost)) {
            drop(task, v, lost, path);
            active &= ~lost;
            scattered &= ~lost;
            out.light = select(lost, zero3(), out.light);
        }
        scatter3(task.incoming, path, active | lost, out.light.x.value, out.light.y.value, out.light.z.value);
        for (int i = 0; i < W; ++i)
            if (scattered[i]) task.next[path[i]] = static_cast<int32_t>(k) * W + i;
        after(v, active, path, in, out);
    }
}

// Positions of all vertices, which later ones look back to.
void locate(const SceneView& scene, const AdjointTask& task) {
    for (int64_t k = 0; k < task.vertices->count; ++k) {
        Vertex& v = task.vertices->at<W>(k);
        const Mask hit = load(v.active) & (load(v.face) >= 0);
        const RidingPoint x =
            riding_point(scene, hit, load(v.face), load(v.instance), load(v.b1), load(v.b2));
        store(v.position[0], x.position.x), store(v.position[1], x.position.y);
        store(v.position[2], x.position.z);
    }
}

EG_INLINE void seed3(Tape& tape, Vec3 to, Mask m, const RawVec3& value) {
    tape.seed(to.x.node, raw::select(m, value.x, 0.0f));
    tape.seed(to.y.node, raw::select(m, value.y, 0.0f));
    tape.seed(to.z.node, raw::select(m, value.z, 0.0f));
}

void path_backward_kernel(const SceneView& scene, const AdjointTask& task, const float* adjoint) {
    const DifferentiableTables none{};
    if (looks_back(scene, task)) {
        Tape silent(*task.tape, none);
        locate(scene, task);
    }
    const int paths = task.image->pixel_count * task.image->samples;
    for (int k = 0; k < paths; ++k)
        for (int c = 0; c < 3; ++c) task.position[c][k] = task.direction[c][k] = 0.0f;
    Tape tape(*task.tape, *task.tables);
    walk_back(scene, task, tape,
              [&](Vertex& v, Mask active, Int path, const ArrivalInputs& in, const Leaving& out) {
                  RawVec3 weight{raw::splat(0.0f), raw::splat(0.0f), raw::splat(0.0f)};
                  for (int i = 0; i < W; ++i) {
                      if (!active[i]) continue;
                      const float* a = adjoint + 3 * static_cast<int64_t>(task.image->first_pixel +
                                                                          path[i] / task.image->samples);
                      weight.x[i] = a[0] * task.image->weight * v.throughput[0][i];
                      weight.y[i] = a[1] * task.image->weight * v.throughput[1][i];
                      weight.z[i] = a[2] * task.image->weight * v.throughput[2][i];
                  }
                  seed3(tape, out.light, active, weight);
                  const Mask scattered = active & ~load(v.passes);
                  if (task.geometry) {
                      seed3(tape, out.position, scattered, gather_raw3(task.position, path));
                      seed3(tape, out.direction, scattered & load(v.specular),
                            gather_raw3(task.direction, path));
                  }
                  tape.backward();
                  if (!task.geometry) return;
                  // Surfaces that a path only went through hand nothing back: its ray is that of the vertex
                  // before.
                  scatter3(task.position, path, scattered, tape.derivative(in.from.x.node),
                           tape.derivative(in.from.y.node), tape.derivative(in.from.z.node));
                  scatter3(task.direction, path, scattered, tape.derivative(in.direction.x.node),
                           tape.derivative(in.direction.y.node), tape.derivative(in.direction.z.node));
              });
}

void path_forward_kernel(const SceneView& scene, const AdjointTask& task, float* const radiance[3]) {
    const DifferentiableTables none{};
    {
        Tape silent(*task.tape, none);
        locate(scene, task);
        // With the very numbers of the backward mode: sharp lobes tell a recorded direction from one that is
        // computed again.
        walk_back(scene, task, silent, [](Vertex&, Mask, Int, const ArrivalInputs&, const Leaving&) {});
    }
    const int paths = task.image->pixel_count * task.image->samples;
    for (int k = 0; k < paths; ++k)
        for (int c = 0; c < 3; ++c) radiance[c][k] = task.position[c][k] = task.direction[c][k] = 0.0f;
    Tape tape(*task.tape, *task.tables);
    for (int64_t k = 0; k < task.vertices->count; ++k) {
        Vertex& v = task.vertices->at<W>(k);
        tape.clear();
        const Mask active = load(v.active), scattered = active & ~load(v.passes), lost = load(v.lost);
        if (any(lost)) forget_place(task, lost, load(v.path));
        const Int path = select(active, load(v.path), splat(0));
        const ArrivalInputs in = arrive(scene, task, v);
        const Leaving out = leave_vertex(scene, *task.vertices, v, in.arrival, load3(v.incoming),
                                         load(v.next), task.geometry);
        if (task.geometry) {
            seed3(tape, in.from, scattered, gather_raw3(task.position, path));
            seed3(tape, in.direction, scattered & load(v.slides), gather_raw3(task.direction, path));
        }
        tape.forward();
        const raw::Float change[3] = {tape.derivative(out.light.x.node), tape.derivative(out.light.y.node),
                                      tape.derivative(out.light.z.node)};
        for (int i = 0; i < W; ++i)
            for (int c = 0; active[i] && c < 3; ++c)
                radiance[c][path[i]] += v.throughput[c][i] * change[c][i];
        if (!task.geometry) continue;
        scatter3(task.position, path, scattered, tape.derivative(out.position.x.node),
                 tape.derivative(out.position.y.node), tape.derivative(out.position.z.node));
        scatter3(task.direction, path, scattered & load(v.specular), tape.derivative(out.direction.x.node),
                 tape.derivative(out.direction.y.node), tape.derivative(out.direction.z.node));
    }
}

}  // namespace

void add_adjoint_path_kernels(KernelTable& table) {
    table.path_backward = path_backward_kernel;
    table.path_forward = path_forward_kernel;
}

}  // namespace edgegrad::EDGEGRAD_ISA
