// Sweeps for derivatives by colours and strengths over the records of a task's paths
// (tasks/records/value_record.h). The light L that leaves a vertex is linear in each colour and strength:
//   L = own_gain * source + color * scale * (light_gain * source + environment_gain * environment + next_gain
//   * L'),
// with the light L' that leaves the next vertex. The sweeps run from the ends of the paths to the camera, so
// that L' is known at each vertex.
#pragma once

#include "path/value_recorder.h"
#include "scene/differentiable_tables.h"
#include "simd/lanes.h"
#include "tasks/adjoint_task.h"
#include "tasks/dropped_samples.h"

namespace edgegrad::EDGEGRAD_ISA {

// A table with three floats per row, and its derivatives. Empty if no derivative of it is requested.
struct ColorTable {
    int32_t stride = 0, offset = 0;  // of rows; position of the first row in the requested span
    int32_t size = 0;                // length of the span
    double* gradient = nullptr;
    const double* tangent = nullptr;

    // The column `column` of `table`.
    static ColorTable of(const DifferentiableTables& tables, const float* table, int32_t column,
                         int32_t stride) {
        for (int t = 0; t < tables.count; ++t) {
            const DifferentiableTable& d = tables.table[t];
            if (d.begin != table) continue;
            if (d.width > 1 && !(d.columns >> column & 7)) break;
            return {stride, static_cast<int32_t>(d.begin - d.first) + column,
                    static_cast<int32_t>(d.last - d.first), d.gradient, d.tangent};
        }
        return {};
    }
    EG_INLINE Int place(Mask& m, Int row) const {
        const Int at = row * stride + offset;
        m &= (at >= 0) & (at < size);
        return at;
    }
    // Adds to the gradient of rows. Lanes of the same row are summed first, because consecutive additions to
    // one address wait for each other.
    EG_INLINE void add(Mask m, Int row, Vec3 value) const {
        if (!gradient) return;
        const Int at = place(m, row);
        const Float* const channel[3] = {&value.x, &value.y, &value.z};
        while (any(m)) {
            const int lane = first_lane(m);
            const Mask same = m & (at == at[lane]);
            m &= ~same;
            for (int c = 0; c < 3; ++c)
                gradient[at[lane] + c] += sum_of_lanes(select(same, *channel[c], 0.0f));
        }
    }
    // The tangents of rows.
    EG_INLINE Vec3 change(Mask m, Int row) const {
        Vec3 out = zero3();
        if (!tangent) return out;
        const Int at = place(m, row);
        for (int i = 0; i < W; ++i) {
            if (!m[i]) continue;
            out.x[i] = static_cast<float>(tangent[at[i]]);
            out.y[i] = static_cast<float>(tangent[at[i] + 1]);
            out.z[i] = static_cast<float>(tangent[at[i] + 2]);
        }
        return out;
    }
};

struct ColorTables {
    ColorTable color, emission, rows, environment;

    ColorTables(const SceneView& scene, const DifferentiableTables& of)
        : color(ColorTable::of(of, scene.closure_params, kBaseColor, kMaterialParams)),
          emission(ColorTable::of(of, scene.closure_params, kEmission, kMaterialParams)),
          rows(ColorTable::of(of, scene.lights.params, kLightRadiance, kLightParams)),
          environment(ColorTable::of(of, scene.environment, 0, 3)) {}

    // Calls visit(table, mask, row) for the table of each source.
    template <typename Visit>
    EG_INLINE void for_each_source(Mask m, Int source, const Visit& visit) const {
        const Int kind = source & ((1 << kSourceBits) - 1), row = source >> kSourceBits;
        const auto one = [&](const ColorTable& table, LightSource of) {
            const Mask here = m & (kind == static_cast<int>(of));
            if (any(here)) visit(table, here, row);
        };
        one(emission, kLeafSource), one(rows, kRowSource), one(environment, kEnvironmentSource);
    }
    EG_INLINE void add(Mask m, Int source, Vec3 value) const {
        for_each_source(m, source, [&](const ColorTable& t, Mask here, Int row) { t.add(here, row, value); });
    }
    EG_INLINE Vec3 change(Mask m, Int source) const {
        Vec3 out = zero3();
        for_each_source(m, source, [&](const ColorTable& t, Mask here, Int row) {
            out = select(here, t.change(here, row), out);
        });
        return out;
    }
};

EG_INLINE Vec3 load3(const float (&field)[3][W]) { return {load(field[0]), load(field[1]), load(field[2])}; }
EG_INLINE Vec3 gather3(float* const (&base)[3], Int at) {
    return {gather(base[0], at), gather(base[1], at), gather(base[2], at)};
}
EG_INLINE void scatter3(float* const (&base)[3], Int at, Mask m, Vec3 a) {
    scatter(base[0], at, m, a.x), scatter(base[1], at, m, a.y), scatter(base[2], at, m, a.z);
}

EG_INLINE Mask finite(Vec3 a) {
    const Float sum = a.x + a.y + a.z;
    return sum - sum == 0.0f;
}

// Counts vertices that are dropped because their light is not finite.
EG_OUTLINE void drop(const ValueTask& task, const Values& v, Mask lost, Int path) {
    for (int i = 0; i < W; ++i)
        if (lost[i]) task.dropped->add(task.image->pixel_of(path[i]), v.face[i], v.instance[i]);
}

// Visits all vertices from the ends of the paths: visit(packet, mask, path, light that a surface of albedo 1
// would scatter).
template <typename Visit>
EG_INLINE void for_each_value(const ValueTask& task, const Visit& visit) {
    const ValueMemory& values = *task.values;
    const int paths = task.image->pixel_count * task.image->samples;
    if (values.colors)
        for (float* p : task.incoming) __builtin_memset(p, 0, sizeof(float) * static_cast<size_t>(paths));
    for (int64_t k = values.count - 1; k >= 0; --k) {
        const Values& v = values.at<W>(k);
        Mask active = load(v.active);
        const Int path = select(active, load(v.path), splat(0));
        Vec3 scattered = zero3(), leaving = zero3();
        if (values.colors) {
            const Vec3 incoming = gather3(task.incoming, path);
            scattered = (load3(v.received) + load3(v.next_gain) * incoming) * load(v.scale);
            leaving = load3(v.own) + load3(v.color) * scattered;
        }
        const Vec3 gains = load3(v.own_gain) + load3(v.light_gain) + load3(v.environment_gain);
        const Mask lost = active & ~(finite(leaving) & finite(gains) & finite(load3(v.throughput)));
        if (any(lost)) {
            drop(task, v, lost, path);
            leaving = select(lost, zero3(), leaving);
        }
        if (values.colors) scatter3(task.incoming, path, active, leaving);
        active &= ~lost;
        if (any(active)) visit(v, active, path, scattered);
    }
}

static void values_backward_kernel(const SceneView& scene, const ValueTask& task, const float* adjoint) {
    const ColorTables tables(scene, *task.tables);
    for_each_value(task, [&](const Values& v, Mask active, Int path, Vec3 scattered) {
        const Int pixel = 3 * (quotient(path, task.image->samples) + task.image->first_pixel);
        const Vec3 seen = {gather(adjoint, pixel), gather(adjoint + 1, pixel), gather(adjoint + 2, pixel)};
        const Vec3 weight = select(active, seen * load3(v.throughput) * splat(task.image->weight), zero3());
        const Vec3 reflected = weight * load3(v.color) * load(v.scale);
        const Vec3 by_color = weight * scattered, by_own = weight * load3(v.own_gain),
                   by_light = reflected * load3(v.light_gain),
                   by_environment = reflected * load3(v.environment_gain);
        const Mask lost =
            active & ~(finite(by_color) & finite(by_own) & finite(by_light) & finite(by_environment));
        if (any(lost)) drop(task, v, lost, path), active &= ~lost;
        const Int closure = load(v.closure);
        tables.color.add(active & (closure >= 0), closure, by_color);
        tables.add(active, load(v.own_source), by_own);
        tables.add(active, load(v.light_source), by_light);
        tables.environment.add(active, splat(0), by_environment);
    });
}

static void values_forward_kernel(const SceneView& scene, const ValueTask& task, float* const radiance[3]) {
    const int paths = task.image->pixel_count * task.image->samples;
    for (int c = 0; c < 3; ++c) __builtin_memset(radiance[c], 0, sizeof(float) * static_cast<size_t>(paths));
    const ColorTables tables(scene, *task.tables);
    for_each_value(task, [&](const Values& v, Mask active, Int path, Vec3 scattered) {
        const Int closure = load(v.closure);
        const Vec3 received = tables.change(active, load(v.light_source)) * load3(v.light_gain) +
                              tables.environment.change(active, splat(0)) * load3(v.environment_gain);
        const Vec3 change = tables.color.change(active & (closure >= 0), closure) * scattered +
                            tables.change(active, load(v.own_source)) * load3(v.own_gain) +
                            load3(v.color) * received * load(v.scale);
        const Vec3 seen = load3(v.throughput) * change;
        const Mask lost = active & ~finite(seen);
        if (any(lost)) drop(task, v, lost, path), active &= ~lost;
        float* const to[3] = {radiance[0], radiance[1], radiance[2]};
        scatter3(to, path, active, gather3(to, path) + seen);
    });
}

}  // namespace edgegrad::EDGEGRAD_ISA
