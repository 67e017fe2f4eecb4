// The kernels of caustics, of one instruction set. It shares parts of other kernels' headers only.
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-function"
#endif
#include "boundary/caustics/caustic_edge.h"
#include "boundary/caustics/caustic_outline.h"
#include "boundary/specular/mirrored_outline.h"
#include "kernels/parts.h"
#include "tasks/kernel_table.h"

namespace edgegrad::EDGEGRAD_ISA {

namespace {

int caustics_kernel(const SceneView& scene, const BoundaryTask& task, ChainCrossings& c) {
    return task.kind == kCausticEdge ? sample_caustic_edges(scene, task, c)
                                     : sample_caustic_outlines(scene, task, c);
}

// Multiplies the jumps of radiance by the weights of the stored paths.
void weigh_caustics_kernel(const SceneView& scene, const BoundaryTask& task, ChainCrossings& c, int count) {
    constexpr float kOff = 1e-2f;  // of a light's outline, by rounding
    for (int at = 0; at < count; at += W) {
        Mask seen = first_lanes(count - at) & load(c.seen + at);
        Vec3 jump, color, by_point, by_direction, from, direction;
        load3(jump, c.jump, at), load3(color, c.curve_point, at);
        load3(by_point, c.by_point, at), load3(by_direction, c.by_direction, at);
        const Mask light = seen & at_light_outline(c, at, count);
        if (any(light)) {
            load3(from, c.from, at), load3(direction, c.direction, at);
            const Float rho = met_outline(scene, light, load(c.outlined_light + at), from, direction).rho;
            seen &= ~light | (abs(rho - 1.0f) < kOff);
        }
        jump = jump * color;
        // Of suns, whose outlines have no place, only the ray's direction counts.
        const Float slope = dot(by_point, by_point), turn = dot(by_direction, by_direction);
        const Float size = select(seen, size_of(jump) * sqrt(select(slope > 0.0f, slope, turn)), 0.0f);
        seen = keep_finite(task, at, seen, load(c.edge + at), load(c.edge_instance + at), size);
        store3(c.jump, at, select(seen, jump, zero3()));
        store(c.seen + at, seen);
        if (!task.score) continue;
        for (int i = 0; i < W && at + i < count; ++i)
            task.score[task.first + c.segment[at + i]] = seen[i] ? size[i] : 0.0f;
    }
}

}  // namespace

void add_caustic_kernels(KernelTable& table) {
    table.caustics = caustics_kernel;
    table.light_beams = find_light_beams;
    table.weigh_caustics = weigh_caustics_kernel;
}

}  // namespace edgegrad::EDGEGRAD_ISA
