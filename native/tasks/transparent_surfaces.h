// The transparent surfaces along shadow rays of recorded vertices (tasks/vertex_record.h), if their
// transmittance may have a derivative. The recorded light does not contain these transmittances. Sweeps
// evaluate their product again (adjoint/transparent_light.h), so that a factor may be zero.
//
// Plain memory: code on raw packets writes it, code on taped packets reads it.
#pragma once

#include <cstdint>

#include "util/tape_memory.h"

namespace edgegrad {

// Shadow rays of a vertex: to an emitter sample, to a sample of the environment's image, and a path's last
// ray.
enum RecordedRay : int32_t { kRayToLight, kRayToEnvironment, kLastRay };

// Bits of a closure: its transparent share may have a derivative, and may have one even where it is 0 or 1.
// Shadow rays of derivatives continue behind the first opaque surface of the second kind.
enum TransparentClosure : int32_t { kShareChanges = 1, kEndsChange = 2 };

// One surface for each ray of a packet, in any order.
template <int N>
struct alignas(64) TransparentPacket {
    int32_t face[N], instance[N];  // face -1: none
    float b1[N], b2[N];
    int32_t vertex;  // index of the vertices' packet
    RecordedRay ray;
};

// The surfaces of a task, in the order of their vertices.
struct TransparentMemory {
    TapeBuffer packets;
    int64_t count = 0;
    const int32_t* closures = nullptr;  // TransparentClosure bits by closure; null: no surface is recorded

    template <int N>
    TransparentPacket<N>& at(int64_t k) const {
        return static_cast<TransparentPacket<N>*>(packets.data())[k];
    }
    // Reserves room for `more` packets.
    template <int N>
    void reserve(int64_t more) {
        const auto bytes = [](int64_t packets) {
            return static_cast<size_t>(packets) * sizeof(TransparentPacket<N>);
        };
        packets.grow(bytes(count + more), bytes(count));
    }
    // Index of the first packet of this vertex or of a later one.
    template <int N>
    int64_t first_of(int32_t vertex) const {
        int64_t low = 0, high = count;
        while (low < high) {
            const int64_t middle = (low + high) / 2;
            (at<N>(middle).vertex < vertex ? low : high) = middle + (at<N>(middle).vertex < vertex);
        }
        return low;
    }
};

}  // namespace edgegrad
