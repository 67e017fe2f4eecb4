// What kernels read of everything that gives light (scene/lights/light_list.h and
// scene/lights/environment_map.h make it).
#pragma once

#include <cstdint>

#include "scene/lights/light_params.h"

namespace edgegrad {

// A light, or a group of them, as seen from afar: what bounds the irradiance that it can give (Conty Estevez
// and Kulla 2018). Its directions of emission lie within the angle o of the axis, and each shines up to e
// away from its own direction.
struct LightNode {
    float center[3];
    float radius;  // of a sphere around it; negative: it is distant, `axis` its direction of travel
    float axis[3];
    float cos_o, sin_o, cos_e;
    float power;        // intensity at most; of a distant light its irradiance
    int32_t two_sided;  // 1: it shines in the axis' opposite directions too
    int32_t child;      // of a group: its first member, the second follows; of a single light -1 - its number
    int32_t parent;     // -1: none
    int32_t unused[2];
};
static_assert(sizeof(LightNode) == 64, "one line of the cache");

struct LightView {
    // Every light: an emissive face or a row of the light table.
    int32_t count;
    const int32_t* kind;
    const int32_t* index;
    const int32_t* node_of;     // each light's node
    const int32_t* face_light;  // (F) the light that a face is, or -1; null: no face emits
    int32_t kinds;              // bits 1 << LightKind of those that occur
    // One is picked among `top` nodes, and where that is a group, on from there.
    const LightNode* nodes;  // those on top first
    int32_t top;
    bool any_group;
    bool dark_too;  // lights without radiance are picked too
    // The light table, see core/tables/lights.py.
    const float* params;
    const int32_t* flags;
    const int32_t* visible_to;
    const int32_t* receivers;
    const int32_t* blockers;
    bool any_linked;              // some light has receivers or blockers of its own, or casts no shadow
    bool any_hidden;              // some light isn't seen by every kind of ray that scatters
    const int32_t* light_of_row;  // (L) the light that a row is, or -1
    // Rows that rays can meet: sized ones. Distant ones come last.
    const int32_t* sized;
    int32_t sized_count, sized_distant;
};

}  // namespace edgegrad
