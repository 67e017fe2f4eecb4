// The record of a picture's paths for derivatives: one packet for each packet of hits that the path tracer
// shades. It contains all random decisions with their weights, so that sweeps evaluate the same light again
// as a function of the scene (adjoint/vertex.h), without tracing a ray.
//
// Plain memory: code on raw packets writes it, code on taped packets reads it.
#pragma once

#include <cstdint>

#include "scene/requested_surfaces.h"
#include "tasks/records/media_on_rays.h"
#include "tasks/records/transparent_surfaces.h"
#include "util/tape_memory.h"

namespace edgegrad {

// In place of a face: the ray crosses a medium. It passes, or is scattered at a fixed distance.
constexpr int32_t kInMedium = -2;

template <int N>
struct alignas(64) VertexPacket {
    using Floats = float[N];
    using Ints = int32_t[N];

    // The ray and its hit. Lanes whose `active` is 0 have no other values.
    Ints active, path;
    // Of the vertex in its path, counting transparent surfaces; equal in all lanes. In media ~number of the
    // next surface, so that a path's vertices never share a packet (path/touched_vertices.h).
    Ints number;
    Ints touched;      // -1: this or an earlier vertex is on a requested surface (scene/requested_surfaces.h)
    Ints screen_form;  // -1: the ray leaves the camera or a specular vertex: its direction is given by the
                       // scene
    Floats lobe_alpha, lobe_slope2;  // RayLobe; set only if some lobe is followed and there are lights
    Ints kind;                       // RayKind
    Ints bounces;                    // by kind (path/path_queue.h)
    Ints bounces_before_last;        // path/path_queue.h; set only if some light has a limit
    Floats from[3];                  // origin of the ray on a surface or the lens
    Floats direction[3], throughput[3];
    Ints face, mesh, instance;  // face -1: no hit, kInMedium: an event in a medium before the hit
    Floats b1, b2;
    // Distances from the previous scattering event to the start of the ray, which may be a transparent
    // surface, and to its hit (infinite: no hit).
    Floats near, far;
    Ints from_mesh;  // of the previous vertex
    // The weight of the fixed-direction form of the ray, and the change of the measure (scene/contact.h).
    Floats fixed_weight, drift[3];

    // The closure chosen among those of the material.
    Ints closure;
    Floats scale;               // sum of the weights of the material's closures
    Ints passes;                // -1: the ray passes a transparent surface unscattered
    Floats emission_weight;     // of the closure's own emission
    Floats environment_weight;  // of light from the environment, without a hit

    // Light from an emitter sample: radiance * f |cos| * light_scale.
    Ints light_face, light_row;  // -1: not of this kind
    Ints light_kind;             // LightKind
    Ints light_visible_to;
    Floats light_b1, light_b2, light_offset[3];
    Floats light_scale[3];
    Floats light_fixed_weight, light_drift[3];  // of an emissive face, as `fixed_weight` and `drift`
    // Bits 1 << Lobe of the lobes that throw light (path/lights/thrown_light.h), and of the one that throws
    // this sample, with its microfacet normal.
    Ints throws, thrown;
    Floats thrown_half[3];
    // From a sample of the environment's image, along environment_direction: radiance * f |cos| *
    // environment_scale.
    Floats environment_direction[3], environment_scale[3];

    // The next ray, whose light is multiplied by f |cos| * next_scale (for perfect lobes by their value
    // instead of f |cos|).
    Ints samples;    // -1: a direction was sampled, even if no ray was traced along it
    Ints diffuse;    // -1: of a Lambertian surface
    Ints continues;  // -1: light may arrive along it
    Ints specular, transmitted, lobe;
    Ints rim;        // the Rim that the ray and the light sample are on (path/rim.h)
    Ints follows;    // bits 1 << Lobe of the followed lobes
    Floats half[3];  // microfacet normal of the sampled mirror, coat or followed lobe
    Floats next_direction[3], next_scale;
    Floats thrown_scale;   // the same for light of the environment that the sampled lobe throws; 0: none
    Floats last_scale[3];  // of the environment's light along it, if it can meet nothing else

    // In media (face kInMedium): MediumFloat, the weight of the scattered or passing light without the
    // scattering coefficient, and the distance from `from` to the scattering event or the ray's end.
    Floats medium_extinction[3], medium_scattering[3], medium_forward, medium_weight[3], medium_way;

    // -1: its light is not finite; the lane is no longer active (adjoint/path_sweeps.cpp).
    Ints lost;
};

// Directions beyond which lobes of a surface scatter no light (path/rim.h).
enum Rim : int32_t { kNoRim, kDiffuseRim, kTransmissionRim, kGlossRim };

// The vertices of a task's paths.
struct VertexMemory {
    TapeBuffer packets;
    int64_t count = 0;
    bool geometry = true;  // positions or directions have derivatives
    bool misses = true;    // light of rays without a hit has derivatives
    RequestedSurfaces requested;
    bool rims = false;         // paths sample rims of lobes only (path/rim.h)
    TransparentMemory passed;  // surfaces passed by the vertices' shadow rays
    MediaMemory media;         // along these and the rays that found vertices in media

    void clear() { count = passed.count = media.count = 0; }
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
