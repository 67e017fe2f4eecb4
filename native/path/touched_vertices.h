// Compacts the recorded vertices that contribute to a derivative. A sweep over a packet
// (adjoint/path_sweeps.cpp) takes the same time for any number of active lanes, far longer than moving the
// lanes.
#pragma once

#include "path/recorder.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// Keeps a vertex if its path has reached a requested surface, or if the next vertex lies on a moving one.
EG_INLINE void keep_contributing_vertices(VertexMemory& memory, int32_t* touched_behind, int paths) {
    __builtin_memset(touched_behind, 0, sizeof(int32_t) * static_cast<size_t>(paths));
    for (int64_t k = memory.count - 1; k >= 0; --k) {
        Vertex& v = memory.at<W>(k);
        for (int i = 0; i < W; ++i) {
            if (!v.active[i]) continue;
            int32_t& behind = touched_behind[v.path[i]];
            v.active[i] = v.touched[i] || (memory.requested.moving && behind) ? -1 : 0;
            behind = v.touched[i];
        }
    }
}

// Compacts the recorded vertices of `paths` paths. Overwrites work.visible.
static void close_up_kernel(Workspace& work, int32_t paths) {
    VertexMemory& memory = *work.vertices;
    if (memory.requested.everywhere) return;
    keep_contributing_vertices(memory, work.visible, paths);
    // A packet that is less than half full gives its lanes to an open packet of vertices with the same
    // number. The order of a path's vertices is kept.
    int64_t count = 0;
    Vertex* open = nullptr;
    int filled = W, number = -1;
    for (int64_t k = 0; k < memory.count; ++k) {
        Vertex& v = memory.at<W>(k);
        int lanes[W], n = 0;
        for (int i = 0; i < W; ++i)
            if (v.active[i]) lanes[n++] = i;
        if (n == 0) continue;
        if (v.number[lanes[0]] != number) filled = W, number = v.number[lanes[0]];
        if (2 * n > W) {
            if (Vertex& to = memory.at<W>(count++); &to != &v) to = v;
            continue;
        }
        if (filled + n > W) open = &memory.at<W>(count++), filled = 0;
        for (int i = 0; i < n; ++i) move_lane(*open, filled++, v, lanes[i]);
        store(open->active, first_lanes(filled));
    }
    memory.count = count;
}

}  // namespace edgegrad::EDGEGRAD_ISA
