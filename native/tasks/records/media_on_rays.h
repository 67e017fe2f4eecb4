// The media along rays of recorded vertices (tasks/records/vertex_record.h), if their coefficients have
// derivatives. The recorded light contains what they keep of it. Sweeps multiply it by how this changes
// (adjoint/media_light.h).
#pragma once

#include "tasks/records/ray_records.h"

namespace edgegrad {

// In place of a material: the medium around all meshes.
constexpr int32_t kWorldMedium = -1;

// One medium for each ray of a packet, in any order. A ray may have several entries of one medium, which add
// up.
template <int N>
struct alignas(64) MediaPacket {
    int32_t material[N];
    float sign[N];  // at the ray's origin; 0: none
    float way[N];   // within the medium, in metres; entries may be negative, their sum is not
    int32_t vertex;
    RecordedRay ray;

    void clear(int lane) { sign[lane] = way[lane] = 0.0f, material[lane] = kWorldMedium; }
};

struct MediaMemory : RayRecords<MediaPacket> {
    bool wanted = false;  // whether media are recorded
};

}  // namespace edgegrad
