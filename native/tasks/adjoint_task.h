// Input and output of sweeps over the recorded vertices of a task's paths.
#pragma once

#include <cstdint>

#include "scene/differentiable_tables.h"
#include "tasks/dropped_samples.h"
#include "tasks/image_task.h"
#include "tasks/records/value_record.h"
#include "tasks/records/vertex_record.h"
#include "util/tape_memory.h"

namespace edgegrad {

// The recorded vertices of a task's paths, and what sweeps over them need.
struct AdjointTask {
    const ImageTask* image;
    VertexMemory* vertices;
    CameraSamples camera;
    TapeMemory* tape;
    const DifferentiableTables* tables;
    bool geometry;      // whether positions, directions or normals change
    bool camera_moves;  // whether camera rays do
    DroppedSamples* dropped;
    // By path, the values that sweeps carry from vertex to vertex: light, the vertex that emits it, and the
    // derivatives of the vertex' position and of a specular ray's direction.
    float* incoming[3];
    int32_t* next;
    float *position[3], *direction[3];
    // The derivatives at the paths' last vertices are given, and a backward sweep starts from them
    // (boundary/specular/chain_term.h).
    bool seeded;
};

// The same for derivatives by colours and strengths.
struct ValueTask {
    const ImageTask* image;
    ValueMemory* values;
    const DifferentiableTables* tables;
    DroppedSamples* dropped;
    float* incoming[3];
};

}  // namespace edgegrad
