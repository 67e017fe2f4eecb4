// Records the transparent surfaces along a packet of shadow rays (tasks/records/transparent_surfaces.h).
#pragma once

#include "scene/view.h"
#include "shading/ray_recorder.h"

namespace edgegrad::EDGEGRAD_ISA {

class TransparentRecorder : public RayRecorder<TransparentMemory, TransparentPacket<W>> {
 public:
    using RayRecorder::RayRecorder;

    // Starts a query.
    void start() {
        RayRecorder::start();
        for (int32_t& dark : dark_) dark = 0;
    }
    // TransparentClosure bits of a material: which derivatives its transmittance has.
    int32_t changes(const SceneView& scene, int32_t material) const {
        int32_t bits = 0;
        for (int32_t closure = scene.material_first_closure[material];
             closure < scene.material_first_closure[material + 1]; ++closure)
            bits |= memory().closures[closure];
        return bits;
    }
    // Returns whether a ray continues behind an opaque surface. Only the first such surface has a derivative.
    bool goes_on(int lane, int32_t changes) { return changes & kEndsChange && dark_[lane]++ == 0; }
    void add(int lane, int32_t face, int32_t instance, float b1, float b2) {
        TransparentPacket<W>* const p = next(lane);
        if (!p) return;
        p->face[lane] = face, p->instance[lane] = instance;
        p->b1[lane] = b1, p->b2[lane] = b2;
    }

 private:
    int32_t dark_[W];
};

}  // namespace edgegrad::EDGEGRAD_ISA
