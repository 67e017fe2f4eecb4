// Scratch memory of one thread as kernels see it; engine/workspace.h allocates it.
#pragma once

#include <cstdint>

#include "tasks/dropped_samples.h"
#include "tasks/image_task.h"
#include "tasks/records/value_record.h"
#include "tasks/records/vertex_record.h"
#include "util/tape_memory.h"

namespace edgegrad {

// Live paths of a task, one array for each value (path/path_queue.h).
struct PathQueue {
    float *origin[3], *direction[3], *throughput[3], *from[3];
    float *from_normal[3], *from_receiving[3], *pdf, *lobe_alpha, *lobe_slope2;
    int32_t *path, *state, *bounces, *from_mesh;
};

// Hits of a queue's rays; face -1: no hit.
struct HitQueue {
    int32_t *face, *mesh, *instance;
    float *b1, *b2, *distance;
    const struct EdgeStarts* edges;  // first hits beside edges; null: ordinary hits
};

// First hits beside edges, one array for each value.
struct EdgeStarts {
    float* aside[3];  // offset to the origin of rays that leave the surface
    int32_t* other;   // the face on the other side, whose radiance is subtracted; -1: none
    float *b1, *b2;   // the hit on it
};

// Scratch memory of one thread.
struct Workspace {
    float* radiance[3];     // by path: L, or its derivative in forward mode
    const ImageTask* task;  // the current task
    // Counts light that pictures leave out because it exceeds the range of floats; null: not counted.
    DroppedSamples* dropped;
    PathQueue paths;
    HitQueue hits;
    // Records of vertices, or of values for derivatives by colours and strengths; null: none.
    VertexMemory* vertices;
    ValueMemory* values;
    CameraSamples camera;
    int32_t* visible;      // by path: whether it is recorded (path/touched_vertices.h)
    EdgeStarts edges;      // memory of hits.edges
    TapeBuffer* segments;  // of a boundary task (boundary/segment/segment.h), in packets
};

}  // namespace edgegrad
