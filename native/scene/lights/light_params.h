// A light that is not a mesh, as a row of floats: the positions of its fields (the same as in
// core/tables/lights.py).
#pragma once

#include <cstdint>

namespace edgegrad {

// Kinds of lights, by how a direction to them is sampled. Distant ones come last.
enum LightKind : int32_t {
    kTriangleLight,  // a face of a mesh; all others are rows of the table
    kPointSource,    // a point or spot light without size
    kSphereLight,
    kDiskLight,  // a disk that always faces its receiver
    kRectangleLight,
    kEllipseLight,
    kDirectionLight,  // a sun without size
    kConeLight        // a sun with a disk
};

// Kinds (1 << LightKind) whose sample positions depend on the receiver (boundary/segment/light_motion.h).
constexpr int32_t kTurningLights = 1 << kSphereLight | 1 << kDiskLight;
// Kinds (1 << LightKind) without size, whose shadows are sharp.
constexpr int32_t kPointlikeLights = 1 << kPointSource | 1 << kDirectionLight;
constexpr bool is_sized(int32_t kind) { return !(kPointlikeLights >> kind & 1); }

enum LightParam : int32_t {
    // Radiance; intensity for a point without size, irradiance for a direction without size.
    kLightRadiance = 0,
    kLightPosition = 3,  // relative to the tables' origin
    // Unit axes of an area light, along its extents. Of a spot whose cone is stretched along them, they
    // come with the inverses of the factors.
    kLightAxisX = 6,
    kLightAxisY = 9,
    kLightDirection =
        12,  // unit: direction of emission (axis of a spot, normal of an area light, travel of a sun)
    kLightExtentX = 15,  // half the size of an area light, metres
    kLightExtentY = 16,
    kLightRadius = 17,  // of a sphere or disk, metres
    kLightArea = 18,    // area of an area light, m^2; solid angle of a sun's cone, sr
    // 1 - cos of half the angle of a sun's cone, or of a round cone about that of a spot; 2: no cone
    kLightOneMinusCos = 19,
    // Factor (edge - t) * scale towards the edge of a spot's cone (t = 1 - cos, or the angle for a linear
    // falloff) and of an area light's spread (t = tan).
    kLightEdge = 20,
    kLightEdgeScale = 21,
    kLightSmooth = 22,  // m^2, of a light with a decay: r^2 / (r^2 + smooth) is a factor of its light
    kLightParams = 24
};

// The limit of bounces of lights without one, as in core/tables/lights.py.
constexpr int32_t kAnyBounces = 1 << 30;

// kLightEdgeScale of edges that are discontinuities.
constexpr float kLightStep = 1e12f;

enum LightFlag : int32_t {
    kLightCone = 1 << 0,  // of a spot, with a smoothstep at its edge
    kLightLinearCone = 1 << 1,
    kLightSpread = 1 << 2,
    kLightCastsShadow = 1 << 3,
    // Light that falls otherwise than with the square of the distance r, by a factor of its radiance:
    kLightDecay = 1 << 4,     // r^2 / (r^2 + smooth)
    kLightByWay = 1 << 5,     // the same times r
    kLightByWay2 = 1 << 6,    // the same times r^2
    kLightStretched = 1 << 7  // of a spot with a smoothstep: its cone is an ellipse
};

}  // namespace edgegrad
