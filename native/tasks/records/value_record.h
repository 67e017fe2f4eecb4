// The record of a picture's paths for derivatives by colours and strengths: one packet for each packet of
// hits that the path tracer shades, and one for each light that its rays meet on the way.
//
// Radiance is linear in the emission of lights, and in the colour of each Lambertian surface:
//   L = own + color * scale * (received + next_gain * L'),
// own = own_gain * its source, received = the sum of light_gain * its source and environment_gain * the
// environment, and light without requested derivatives; L' arrives along the next ray. So the derivatives at
// a vertex are products of the throughput before it and the radiance L' behind it. A tape (adjoint/vertex.h)
// gives the same values, but evaluates the vertex again.
#pragma once

#include <cstdint>

#include "scene/requested_surfaces.h"
#include "util/tape_memory.h"

namespace edgegrad {

// A light source: its table, and its row in the higher bits.
enum LightSource : int32_t { kNoSource = 0, kLeafSource = 1, kRowSource = 2, kEnvironmentSource = 3 };
constexpr int kSourceBits = 2;

template <int N>
struct alignas(64) ValuePacket {
    using Floats = float[N];
    using Ints = int32_t[N];

    Ints active, path;
    Ints face, instance;  // of the hit, for messages; face -1: none
    Floats throughput[3];
    Ints own_source, light_source;  // LightSource
    Floats own[3], own_gain[3];     // `own` and `received` are used if `colors` are requested
    Ints closure;                   // closure with the base colour `color`; -1: not Lambertian
    Floats color[3], scale;
    Floats received[3], light_gain[3], environment_gain[3], next_gain[3];
};

// The values of a task's paths.
struct ValueMemory {
    TapeBuffer packets;
    int64_t count = 0;
    RequestedSurfaces requested;
    // The requested values: colours, which give all light a derivative; or the strengths of closures'
    // emission, of rows of the light table, and of the environment.
    bool colors = false, emission = false, rows = false, environment = false;

    template <int N>
    ValuePacket<N>& at(int64_t k) const {
        return static_cast<ValuePacket<N>*>(packets.data())[k];
    }
    // The packet that is written to, even if it has been discarded since.
    template <int N>
    ValuePacket<N>& latest() const {
        return *static_cast<ValuePacket<N>*>(packet);
    }
    // A new packet, all zero.
    template <int N>
    ValuePacket<N>& append() {
        constexpr size_t size = sizeof(ValuePacket<N>);
        const size_t used = static_cast<size_t>(count) * size;
        if (packets.size() < used + size) packets.grow(2 * used + 64 * size, used);
        ValuePacket<N>& p = at<N>(count++);
        __builtin_memset(&p, 0, size);
        packet = &p;
        return p;
    }

    void* packet = nullptr;
};

}  // namespace edgegrad
