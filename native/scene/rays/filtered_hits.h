// The hits that Embree passes to a filter along rays which any surface may block.
#pragma once

#include "scene/rays/rays.h"

namespace edgegrad::EDGEGRAD_ISA {

// Context of a query whose filter looks at all surfaces along rays. Embree calls the filter once for each
// surface, in any order.
struct AlongRays {
    EdgeContext edges;  // first: Embree passes its address to the filter
    float direction[3][W];

    void start(const SceneView& scene, const Ignored& ignored, Vec3 along) {
        edges.scene = &scene;
        store(edges.edge, ignored.edge);
        store(edges.instance, ignored.instance);
        store(direction[0], along.x), store(direction[1], along.y), store(direction[2], along.z);
    }
};

// The hits of one call of a filter, by the rays' lanes, so that a lane's values do not depend on the part of
// the packet that Embree traverses.
struct FilteredHits {
    Mask active = splat(0);
    Int face = splat(0), instance = splat(-1);
    Float b1 = splat(0.0f), b2 = splat(0.0f);
    Vec3 direction = {splat(0.0f), splat(0.0f), splat(1.0f)};
    Float way = splat(0.0f);  // to the hit, in lengths of the direction
    uint32_t slot[W] = {};    // of a lane's hit in the arguments

    EG_INLINE FilteredHits(const embree::FilterArguments* args, const AlongRays& along) {
        const SceneView& scene = *along.edges.scene;
        const auto* ray = static_cast<const uint32_t*>(args->ray);
        const auto* hit = static_cast<const uint32_t*>(args->hit);
        const uint32_t n = args->n;
        for (uint32_t i = 0; i < n; ++i) {
            if (!args->valid[i]) continue;
            const uint32_t lane = ray[10 * n + i];
            slot[lane] = i;
            active[lane] = -1;
            const auto real = [&](const uint32_t* from, uint32_t field) {
                float value;
                __builtin_memcpy(&value, from + field * n + i, 4);
                return value;
            };
            b1[lane] = real(hit, 3), b2[lane] = real(hit, 4);
            face[lane] = scene.mesh_first_face[hit[6 * n + i]] + static_cast<int32_t>(hit[5 * n + i]);
            const uint32_t number = hit[7 * n + i];
            instance[lane] =
                number == embree::kInvalidId ? -1 : static_cast<int32_t>(number) - scene.mesh_count;
            direction.x[lane] = along.direction[0][lane];
            direction.y[lane] = along.direction[1][lane];
            direction.z[lane] = along.direction[2][lane];
            way[lane] = real(ray, 8);
        }
    }
};

}  // namespace edgegrad::EDGEGRAD_ISA
