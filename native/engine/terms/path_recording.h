// What a call's paths are recorded for: which vertices its sweeps need.
#pragma once

#include <vector>

#include "engine/derivative_tables.h"
#include "engine/terms/term.h"
#include "scene/requested_surfaces.h"
#include "tasks/adjoint_task.h"

namespace edgegrad {

struct PathRecording {
    const Requested& requested;
    const bool geometry;                // whether positions, directions or normals of vertices change
    const std::vector<int32_t> passed;  // TransparentClosure bits by closure; empty: none
    const RequestedSurfaces surfaces;

    // A sweep over a task's paths, whose vertices are recorded from now on.
    AdjointTask begin(const TermRun& run, const ImageTask& task) const {
        Workspace& work = run.work();
        AdjointTask sweep = run.memory.adjoint.task(task, work);
        sweep.tables = &run.tables;
        sweep.geometry = geometry;
        sweep.camera_moves = requested.any("camera");
        work.vertices->geometry = sweep.geometry;
        // Rays that meet nothing bring what has a derivative by itself, or since they turn.
        work.vertices->misses = run.scene.lights.sized_count + run.scene.lights.sized_distant > 0 ||
                                run.scene.sky.pixels || requested.any("environment");
        work.vertices->requested = surfaces;
        work.vertices->passed.closures = passed.empty() ? nullptr : passed.data();
        return sweep;
    }
};

}  // namespace edgegrad
