// The vertices that the sweeps of a call need recorded.
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

    // Starts to record vertices of a task's paths, and returns a sweep over them.
    AdjointTask begin(const TermRun& run, const ImageTask& task) const {
        Workspace& work = run.work();
        const bool media = requested.floats().changes_media();
        AdjointTask sweep = run.memory.adjoint.task(task, work);
        sweep.tables = &run.tables;
        sweep.geometry = geometry;
        sweep.camera_moves = requested.any(FloatTable::kCamera);
        work.vertices->geometry = sweep.geometry;
        // Light of rays without a hit has a derivative by its own parameters, or by the ray's direction.
        work.vertices->misses = run.scene.lights.all_sized() > 0 || run.scene.environment_image.pixels ||
                                requested.any(FloatTable::kEnvironment) || media;
        work.vertices->requested = surfaces;
        work.vertices->media.wanted = media;
        work.vertices->passed.closures = passed.empty() ? nullptr : passed.data();
        return sweep;
    }
};

}  // namespace edgegrad
