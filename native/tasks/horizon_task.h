// Paths of the picture at whose vertices the horizon term is estimated (boundary/terms/horizon.h).
#pragma once

#include <cstdint>

#include "tasks/dropped_samples.h"
#include "tasks/image_task.h"

namespace edgegrad {

// Paths of the picture at whose vertices the faces' own planes cut off light (boundary/terms/horizon.h).
struct HorizonTask {
    ImageTask image;
    bool lights, surfaces;  // of lights and the environment; that surfaces scatter
    DroppedSamples* dropped;
};

}  // namespace edgegrad
