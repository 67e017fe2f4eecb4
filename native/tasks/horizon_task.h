// The task of the horizon term.
#pragma once

#include "tasks/dropped_samples.h"
#include "tasks/image_task.h"

namespace edgegrad {

// Paths of the picture, at whose vertices the faces' own planes cut off light (boundary/terms/horizon.h).
struct HorizonTask {
    ImageTask image;
    bool lights, surfaces;  // light of lights and the environment; light that surfaces scatter
    DroppedSamples* dropped;
};

}  // namespace edgegrad
