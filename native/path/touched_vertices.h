// Compacts the recorded vertices that contribute to a derivative. A sweep over a packet
// (adjoint/path_sweeps.cpp) takes the same time for any number of active lanes, far longer than moving the
// lanes.
#pragma once

#include "path/recorder.h"
#include "tasks/workspace_view.h"

namespace edgegrad::EDGEGRAD_ISA {

// Whether the light of the first vertex of a path comes from a constant environment alone, without
// occlusion. `missed`: the ray that continues has met nothing.
EG_INLINE bool evenly_lit(const Vertex& v, int lane, bool missed) {
    if (v.number[lane] != 0 || !v.diffuse[lane]) return false;
    for (int c = 0; c < 3; ++c) {
        if (v.light_scale[c][lane] != 0.0f) return false;
        missed &= v.last_scale[c][lane] == 0.0f;
    }
    const auto whole = [&](int c) { return v.last_scale[c][lane] == v.next_scale[lane]; };
    return missed || (whole(0) && whole(1) && whole(2));
}

// Keeps a vertex if its path has reached a requested surface, or if the next vertex lies on a moving one.
// Drops paths whose light is even (RequestedSurfaces::even_light).
EG_INLINE void keep_contributing_vertices(VertexMemory& memory, int32_t* behind_of, int paths) {
    // By path, of the vertex behind: 0 untouched; k > 0 touched, a ray that missed, in lane k - 1; -1 touched
    __builtin_memset(behind_of, 0, sizeof(int32_t) * static_cast<size_t>(paths));
    const RequestedSurfaces& requested = memory.requested;
    for (int64_t k = memory.count - 1; k >= 0; --k) {
        Vertex& v = memory.at<W>(k);
        for (int i = 0; i < W; ++i) {
            if (!v.active[i]) continue;
            int32_t& behind = behind_of[v.path[i]];
            if (requested.even_light && evenly_lit(v, i, behind > 0)) {
                v.active[i] = 0;
                if (behind > 0) memory.at<W>((behind - 1) / W).active[(behind - 1) % W] = 0;
                continue;
            }
            v.active[i] = v.touched[i] || (requested.moving && behind) ? -1 : 0;
            const bool missed = v.face[i] < 0 && v.environment_weight[i] == 1.0f;
            behind = !v.touched[i] ? 0 : missed ? static_cast<int32_t>(k) * W + i + 1 : -1;
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
