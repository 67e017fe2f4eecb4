// What derivatives by colours and strengths need of a picture's paths: one packet for each packet of ray
// ends that the path tracer shades, and one for each light that they meet on their way.
//
// Light is linear in what lights give, and in the colour of each surface that scatters it like Lambert's:
//   L = own + color * scale * (received + next_gain * L'),
// own = own_gain * its source, received = the sum of light_gain * its source and sky_gain * the environment,
// and light that isn't requested; L' arrives by the ray that goes on. So the derivatives at a vertex are
// products of what lies before it (throughput) and behind it (L'). A tape (adjoint/vertex.h) has the same
// values, but computes the vertex once more.
#pragma once

#include <cstdint>

#include "scene/requested_surfaces.h"
#include "util/tape_memory.h"

namespace edgegrad {

// What gives light: the table, and its row in the bits above.
enum LightSource : int32_t { kNoSource = 0, kLeafSource = 1, kRowSource = 2, kEnvironmentSource = 3 };
constexpr int kSourceBits = 2;

template <int N>
struct alignas(64) ValuePacket {
    using Floats = float[N];
    using Ints = int32_t[N];

    Ints active, path;
    Ints face, instance;  // that was met, for messages; face -1: none
    Floats throughput[3];
    Ints own_source, light_source;  // LightSource
    Floats own[3], own_gain[3];     // the light itself is read where `colors` are requested, as `received` is
    Ints closure;  // whose base colour `color` is; -1: no surface that scatters like Lambert's
    Floats color[3], scale;
    Floats received[3], light_gain[3], sky_gain[3], next_gain[3];
};

// The values of a task's paths.
struct ValueMemory {
    TapeBuffer packets;
    int64_t count = 0;
    RequestedSurfaces requested;
    // What is requested: colours, of which all light has derivatives; else the strengths of shaders'
    // emission, of rows of the light table, and of the environment.
    bool colors = false, emission = false, rows = false, environment = false;

    template <int N>
    ValuePacket<N>& at(int64_t k) const {
        return static_cast<ValuePacket<N>*>(packets.data())[k];
    }
    // The one that is written to, even if it has been taken back since.
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
