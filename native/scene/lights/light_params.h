// A light that is no mesh, as a row of floats: the places of its fields (core/tables/lights.py has the same).
#pragma once

#include <cstdint>

namespace edgegrad {

// What gives light, by how a direction to it is found; distant ones last.
enum LightKind : int32_t {
    kTriangleLight,  // a face of a mesh; the rest are rows of the table
    kPointSource,    // a point or spot light without size
    kSphereLight,
    kDiskLight,  // a disk that always faces the point it lights
    kRectangleLight,
    kEllipseLight,
    kDirectionLight,  // a sun without size
    kConeLight        // a sun with a disk
};

// Kinds (1 << LightKind) of which a sample's place depends on the point that it lights
// (boundary/segment/light_motion.h).
constexpr int32_t kTurningLights = 1 << kSphereLight | 1 << kDiskLight;

enum LightParam : int32_t {
    // Radiance; of a point without size its intensity, of a direction without size its irradiance.
    kLightRadiance = 0,
    kLightPosition = 3,  // relative to the tables' origin
    kLightAxisX = 6,     // unit axes of an area light, along its extents
    kLightAxisY = 9,
    kLightDirection =
        12,  // unit: where it shines to (axis of a spot, normal of an area light, travel of a sun)
    kLightExtentX = 15,  // half the size of an area light, metres
    kLightExtentY = 16,
    kLightRadius = 17,       // of a sphere or disk, metres
    kLightArea = 18,         // of an area light, m^2; of a sun's cone its solid angle, sr
    kLightOneMinusCos = 19,  // 1 - cos of half the angle of a spot's or sun's cone; 2: no cone
    // Factor (edge - t) * scale towards the edge of a spot's cone (t = 1 - cos, or the angle where it falls
    // linearly) and of an area light's spread (t = tan).
    kLightEdge = 20,
    kLightEdgeScale = 21,
    kLightParams = 24
};

// kLightEdgeScale of edges that are steps.
constexpr float kLightStep = 1e12f;

enum LightFlag : int32_t {
    kLightCone = 1 << 0,  // of a spot, its edge a smoothstep
    kLightLinearCone = 1 << 1,
    kLightSpread = 1 << 2,
    kLightCastsShadow = 1 << 3
};

}  // namespace edgegrad
