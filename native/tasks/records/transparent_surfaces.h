// The transparent surfaces along shadow rays of recorded vertices (tasks/records/vertex_record.h), if their
// transmittance may have a derivative. The recorded light does not contain these transmittances. Sweeps
// evaluate their product again (adjoint/transparent_light.h), so that a factor may be zero.
#pragma once

#include "tasks/records/ray_records.h"

namespace edgegrad {

// Bits of a closure: its transparent share may have a derivative, and may have one even where it is 0 or 1.
// Shadow rays of derivatives continue behind the first opaque surface of the second kind.
enum TransparentClosure : int32_t { kShareChanges = 1, kEndsChange = 2 };

// One surface for each ray of a packet, in any order.
template <int N>
struct alignas(64) TransparentPacket {
    int32_t face[N], instance[N];  // face -1: none
    float b1[N], b2[N];
    int32_t vertex;
    RecordedRay ray;

    void clear(int lane) { face[lane] = -1; }
};

struct TransparentMemory : RayRecords<TransparentPacket> {
    const int32_t* closures = nullptr;  // TransparentClosure bits by closure; null: no surface is recorded
};

}  // namespace edgegrad
