// Records the media along a packet of rays (tasks/records/media_on_rays.h).
#pragma once

#include "shading/ray_recorder.h"

namespace edgegrad::EDGEGRAD_ISA {

class MediaRecorder : public RayRecorder<MediaMemory, MediaPacket<W>> {
 public:
    using RayRecorder::RayRecorder;

    // Adds `way` metres within a medium, which is at the ray's origin with the sign `sign`.
    void add(int lane, int32_t material, float sign, float way) {
        MediaPacket<W>* p = nullptr;
        for (int32_t level = 0; level < kept(lane); ++level)
            if (packet(level).material[lane] == material) p = &packet(level);
        if (!p) p = next(lane);
        if (!p) return;
        p->material[lane] = material;
        p->sign[lane] += sign, p->way[lane] += way;
    }
};

}  // namespace edgegrad::EDGEGRAD_ISA
