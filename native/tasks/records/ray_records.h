// Records of what the rays of recorded vertices pass (tasks/records/vertex_record.h), where it may have a
// derivative.
//
// Plain memory: code on raw packets writes it, code on taped packets reads it.
#pragma once

#include <cstdint>

#include "util/tape_memory.h"

namespace edgegrad {

// Rays of a vertex: to an emitter sample, to a sample of the environment's image, a path's last ray, and the
// one that found the vertex.
enum RecordedRay : int32_t { kRayToLight, kRayToEnvironment, kLastRay, kArrivingRay };

// The records of a task, in the order of their vertices: packets with one entry for each ray. A packet has
// the fields `vertex` (index of the vertices' packet) and `ray`, and clear(lane) removes an entry.
template <template <int> typename Packet>
struct RayRecords {
    TapeBuffer packets;
    int64_t count = 0;

    template <int N>
    Packet<N>& at(int64_t k) const {
        return static_cast<Packet<N>*>(packets.data())[k];
    }
    // Reserves room for `more` packets.
    template <int N>
    void reserve(int64_t more) {
        const auto bytes = [](int64_t number) { return static_cast<size_t>(number) * sizeof(Packet<N>); };
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
