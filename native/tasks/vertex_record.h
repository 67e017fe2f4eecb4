// What the derivatives of a picture need to know of its paths: one packet for each packet of ray ends that
// the path tracer shades. Everything that was decided at random is here with its weight, so that the same
// light can be computed once more as a function of the scene (adjoint/vertex.h), without tracing a ray.
//
// Plain memory: it is written by code on raw packets and read by code on taped ones.
#pragma once

#include <cstdint>

#include "scene/requested_surfaces.h"
#include "tasks/transparent_surfaces.h"
#include "util/tape_memory.h"

namespace edgegrad {

template <int N>
struct alignas(64) VertexPacket {
    using Floats = float[N];
    using Ints = int32_t[N];

    // The ray and what it met. Lanes whose `active` is 0 hold nothing else.
    Ints active, path;
    Ints number;   // of the vertex in its path, passed surfaces included; the same in all lanes
    Ints touched;  // -1: it, or one before, is on a requested surface (scene/requested_surfaces.h)
    Ints slides;   // -1: from the camera or a specular vertex, so its direction is a function of the scene
    Ints arrives_followed;  // -1: from a followed lobe: lights of the table are that vertex' own
    Ints kind;              // RayKind
    Floats from[3];         // the surface point that scattered it, or the camera's
    Floats direction[3], throughput[3];
    Ints face, mesh, instance;  // face -1: it met nothing
    Floats b1, b2;
    Floats near, far;  // distances from the vertex before that it went, surfaces passed or not; infinite: it
                       // met nothing
    Ints from_mesh;    // of the vertex before
    // How much the direction from there is held, and what moves the measure then (scene/contact.h).
    Floats held, drift[3];

    // The shader that was picked among the material's, and what it does.
    Ints closure;
    Floats scale;            // sum of the weights of the material's shaders
    Ints passes;             // -1: goes through the surface unscattered
    Floats emission_weight;  // of light that it gives by itself
    Floats sky_weight;       // of light from the environment, where nothing was met

    // Light from an emitter sample: radiance * f |cos| * light_scale.
    Ints light_face, light_row;  // -1: not that
    Ints light_kind;             // LightKind
    Ints light_visible_to;
    Floats light_b1, light_b2, light_offset[3];
    Floats light_scale[3];
    Floats light_held, light_drift[3];  // of a face, as `held` and `drift`
    // From a sample of the environment's image, along sky_direction: radiance * f |cos| * sky_scale.
    Floats sky_direction[3], sky_scale[3];

    // The ray that goes on, whose light is multiplied with f |cos| * next_scale (of perfectly specular lobes
    // their value instead of f |cos|).
    Ints samples;    // -1: a direction was sampled, even if no ray was traced along it
    Ints continues;  // -1: light may come along it
    Ints specular, transmitted, lobe;
    Ints rim;  // -1: it goes along the rim of the transmission lobe (path/rim.h), as its light sample does
    Ints follows;  // bits 1 << Lobe of those that are followed, and of such a one the microfacet's normal
    Floats half[3];
    Floats next_direction[3], next_scale;
    Floats last_scale[3];  // of environment's light along it, where nothing else could be met

    // -1: its light is not finite; the lane is no longer active (adjoint/path_sweeps.cpp).
    Ints lost;
};

// The vertices of a task's paths.
struct VertexMemory {
    TapeBuffer packets;
    int64_t count = 0;
    bool geometry = true;  // positions or directions have derivatives
    bool misses = true;    // so has what rays bring that meet nothing
    RequestedSurfaces requested;
    bool rims = false;  // paths look for rims of transmission lobes, and bring nothing else (path/rim.h)
    TransparentMemory passed;  // by the vertices' shadow rays

    void clear() { count = passed.count = 0; }
    template <int N>
    VertexPacket<N>& at(int64_t k) const {
        return static_cast<VertexPacket<N>*>(packets.data())[k];
    }
    // A new packet, all zero.
    template <int N>
    VertexPacket<N>& append() {
        constexpr size_t size = sizeof(VertexPacket<N>);
        const size_t used = static_cast<size_t>(count) * size;
        if (packets.size() < used + size) packets.grow(2 * used + 64 * size, used);
        VertexPacket<N>& p = at<N>(count++);
        __builtin_memset(&p, 0, size);
        return p;
    }
};

// A camera path's place in the picture and on the lens, by path.
struct CameraSamples {
    float *x, *y, *lens_u, *lens_v;
};

}  // namespace edgegrad
