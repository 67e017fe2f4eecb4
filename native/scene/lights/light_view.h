// All light sources as kernels read them (built by scene/lights/light_list.h and
// scene/lights/environment_map.h).
#pragma once

#include <cstdint>

#include "scene/lights/light_params.h"

namespace edgegrad {

// A light or a group of lights, with what bounds its irradiance (Conty Estevez and Kulla 2018). Its
// directions of emission lie within the angle o of the axis. Each light emits up to the angle e from its own
// direction.
struct LightNode {
    float center[3];
    float radius;  // of a bounding sphere; negative: a distant light, whose `axis` is its direction of travel
    float axis[3];
    float cos_o, sin_o, cos_e;
    float power;        // bound of the intensity; irradiance of a distant light
    int32_t two_sided;  // 1: it also emits in the opposite directions
    int32_t child;   // of a group: its first child, followed by the second; of a single light: -1 - its index
    int32_t parent;  // -1: none
    // Of lights whose irradiance falls with the distance r as 1/r, and of those whose does not fall: the
    // light of all kinds together is that of the intensity power + by_way r + by_way2 r^2.
    float by_way, by_way2;

    float intensity(float r) const { return power + r * (by_way + r * by_way2); }
};
static_assert(sizeof(LightNode) == 64, "one line of the cache");

struct LightView {
    // Every light: an emissive face or a row of the light table.
    int32_t count;
    const int32_t* kind;
    const int32_t* index;
    const int32_t* node_of;     // node of each light
    const int32_t* face_light;  // (F) index of a face's light, or -1; null: no face emits
    int32_t kinds;              // bits 1 << LightKind of the kinds that occur
    // One of the `top` nodes is chosen; if it is a group, one of its lights is chosen next.
    const LightNode* nodes;  // the top nodes first
    int32_t top;
    bool any_group;
    bool dark_too;  // lights without radiance are chosen too
    // The light table, see core/tables/lights.py.
    const float* params;
    const int32_t* flags;
    const int32_t* visible_to;
    const int32_t* receivers;
    const int32_t* blockers;
    const int32_t* max_bounces;   // of a path before a surface that the light still illuminates
    bool any_linked;              // some light has its own receivers or blockers, or casts no shadow
    bool any_bounded;             // some light has a limit of bounces
    bool any_by_way;              // some light falls less than with the square of the distance
    bool any_hidden;              // some light is not visible to every kind of scattered ray
    const int32_t* light_of_row;  // (L) index of a row's light, or -1
    // Rows that rays can meet, which have a size. Distant ones come last.
    const int32_t* sized;
    int32_t sized_count, sized_distant;

    int32_t all_sized() const { return sized_count + sized_distant; }
};

}  // namespace edgegrad
