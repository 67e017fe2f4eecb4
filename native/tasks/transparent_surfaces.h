// What shadow rays of recorded vertices (tasks/vertex_record.h) pass: the places on surfaces whose
// transparent share may have a derivative. The shares themselves are not part of the light that is recorded:
// their product is computed once more with it (adjoint/transparent_light.h), so that one of them may well be
// zero.
//
// Plain memory: it is written by code on raw packets and read by code on taped ones.
#pragma once

#include <cstdint>

#include "util/tape_memory.h"

namespace edgegrad {

// Shadow rays of a vertex: towards a sample of the lights, of the environment's image, and a path's last ray.
enum RecordedRay : int32_t { kRayToLight, kRayToEnvironment, kLastRay };

// Bits of a shader: its share may have a derivative, and has one even where all or nothing is let through.
// Rays of derivatives go on behind the first opaque one of such surfaces.
enum TransparentClosure : int32_t { kShareChanges = 1, kEndsChange = 2 };

// One surface of each ray, in any order.
template <int N>
struct alignas(64) TransparentPacket {
    int32_t face[N], instance[N];  // face -1: none
    float b1[N], b2[N];
    int32_t vertex;  // number of the vertices' packet
    RecordedRay ray;
};

// Those of a task, in the order of their vertices.
struct TransparentMemory {
    TapeBuffer packets;
    int64_t count = 0;
    const int32_t* closures = nullptr;  // TransparentClosure bits by leaf; null: no surface is recorded

    template <int N>
    TransparentPacket<N>& at(int64_t k) const {
        return static_cast<TransparentPacket<N>*>(packets.data())[k];
    }
    // Room for `more` packets behind those that count.
    template <int N>
    void reserve(int64_t more) {
        const auto bytes = [](int64_t packets) {
            return static_cast<size_t>(packets) * sizeof(TransparentPacket<N>);
        };
        packets.grow(bytes(count + more), bytes(count));
    }
    // The first packet of a vertex or a later one.
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
