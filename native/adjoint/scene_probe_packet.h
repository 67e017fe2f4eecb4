// A packet of points at which parts of the shading code are evaluated.
#pragma once

#include "simd/vector.h"
#include "tasks/probe_tasks.h"

namespace edgegrad::EDGEGRAD_ISA {

// Inputs and outputs of one packet of a SceneProbe.
struct SceneProbePacket {
    Mask active;
    Int index, instance;
    Vec3 a, b;
    Float output[kSceneOutputs];

    EG_INLINE void put(int place, Vec3 v) {
        output[place] = v.x, output[place + 1] = v.y, output[place + 2] = v.z;
    }
};

}  // namespace edgegrad::EDGEGRAD_ISA
