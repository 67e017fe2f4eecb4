// Directions within the tangent plane of a surface towards lights with a size: uniform in the angle under
// which the plane meets the light. The section of a plane with a rectangle, an ellipse or a triangle is a
// line. All other lights are replaced by a ball around them, or by the cone of a distant light.
#pragma once

#include "shading/lights/light_samples.h"

namespace edgegrad::EDGEGRAD_ISA {

// A ball around a light, or a cone around a distant one, as seen from a point.
struct LightBall {
    Vec3 center;   // relative to the point; distant: the unit direction
    Float radius;  // distant: the sine of the cone's angle
    Mask distant;
};

EG_INLINE LightBall ball_around(const LightRow& l, Mask distant, Vec3 from) {
    constexpr float kSlack = 1.001f;
    const Float cosine = 1.0f - l.one_minus_cos;
    return {select(distant, -l.direction, l.position - from),
            select(distant, sqrt(max(l.one_minus_cos * (1.0f + cosine), 0.0f)), l.radius) * kSlack, distant};
}

// A direction in the plane with a normal, uniform in the angle under which the plane sees a ball. Sets this
// angle; 0: the plane does not meet the ball.
EG_INLINE Vec3 tangent_to_ball(const LightBall& ball, Vec3 normal, Float v, Float& angle) {
    constexpr float kPi = 3.14159265f;
    const Float height = dot(normal, ball.center), square = dot(ball.center, ball.center);
    Vec3 a, b;
    basis(normal, a, b);
    const Vec3 flat = ball.center - normal * height;
    const Float length = sqrt(dot(flat, flat));
    const Mask centered = length <= 1e-6f * sqrt(square);
    const Vec3 axis = select(centered, a, flat * (1.0f / select(centered, splat(1.0f), length)));
    // The ball's section with the plane is a disk of radius^2 = radius^2 - height^2
    const Float section = ball.radius * ball.radius - select(ball.distant, splat(0.0f), height * height);
    // The cone of a distant light: cos(half angle) = cos(cone) / cos(elevation)
    const Float cone = sqrt(max(1.0f - ball.radius * ball.radius, 0.0f));
    const Float opposite =
        select(ball.distant, sqrt(max(length * length - cone * cone, 0.0f)), sqrt(max(section, 0.0f)));
    const Float adjacent = select(ball.distant, cone, sqrt(max(length * length - section, 0.0f)));
    const Mask meets = select(ball.distant, length > cone, section > 0.0f);
    const Mask around = ~ball.distant & (section >= length * length);
    const Float half = select(around, splat(kPi), atan2(opposite, max(adjacent, 1e-30f)));
    angle = select(meets, 2.0f * half, 0.0f);
    Float sine, cosine;
    const Float turn = (2.0f * v - 1.0f) * half * (0.5f / kPi);
    sincos_turn(min(select(turn < 0.0f, turn + 1.0f, turn), splat(0.99999994f)), sine, cosine);
    return axis * cosine + cross(normal, axis) * sine;
}

// The line in which the plane through a point meets a flat light, relative to the point. Polygons have their
// corners in order.
struct PlaneSection {
    Vec3 end[2];
    Mask meets;
};
template <int kCorners>
EG_INLINE PlaneSection section_of_polygon(const Vec3 (&corner)[kCorners], Vec3 normal) {
    PlaneSection out{{zero3(), zero3()}, splat(0)};
    Mask one = splat(0);  // of the ends is known
    Float height = dot(normal, corner[kCorners - 1]);
    for (int k = 0; k < kCorners; ++k) {
        const Vec3 before = corner[(k + kCorners - 1) % kCorners];
        const Float next = dot(normal, corner[k]);
        const Mask crosses = (height >= 0.0f) ^ (next >= 0.0f);
        const Vec3 at =
            before + (corner[k] - before) * (height / select(crosses, height - next, splat(1.0f)));
        out.end[0] = select(crosses & ~one, at, out.end[0]);
        out.end[1] = select(crosses & one, at, out.end[1]);
        out.meets |= crosses & one;
        one |= crosses;
        height = next;
    }
    return out;
}
// The points center + x cos t + y sin t.
EG_INLINE PlaneSection section_of_ellipse(Vec3 center, Vec3 x, Vec3 y, Vec3 normal) {
    const Float height = dot(normal, center), along_x = dot(normal, x), along_y = dot(normal, y),
                square = along_x * along_x + along_y * along_y, rest = square - height * height;
    const Mask meets = rest > 0.0f;
    const Float inverse = 1.0f / select(meets, square, splat(1.0f)), half = sqrt(max(rest, 0.0f)) * inverse,
                middle = -height * inverse;
    PlaneSection out;
    for (int k = 0; k < 2; ++k) {
        const Float aside = k == 0 ? half : -half;
        out.end[k] =
            center + x * (middle * along_x - aside * along_y) + y * (middle * along_y + aside * along_x);
    }
    out.meets = meets;
    return out;
}

// A direction towards a line in the plane with a normal, uniform in the angle under which the line is seen.
// Sets this angle; 0: there is no line.
EG_INLINE Vec3 direction_to_section(const PlaneSection& line, Vec3 normal, Float v, Float& angle) {
    const Vec3 first = line.end[0] - normal * dot(normal, line.end[0]);
    const Float square = dot(first, first);
    const Vec3 axis = first * (1.0f / sqrt(select(line.meets & (square > 0.0f), square, splat(1.0f))));
    const Vec3 across = cross(normal, axis);
    // The angle from the first end to the second one, with its sign
    const Float turn = atan2(dot(line.end[1], across), dot(line.end[1], axis));
    angle = select(line.meets & (square > 0.0f), abs(turn), 0.0f);
    Float sine, cosine;
    const Float part = v * turn * (0.5f / 3.14159265f);
    sincos_turn(min(select(part < 0.0f, part + 1.0f, part), splat(0.99999994f)), sine, cosine);
    return axis * cosine + across * sine;
}

// A tangent of a surface with a normal at a point, towards a light. Sets the angle in which it is uniform; 0:
// no tangent meets the light.
EG_OUTLINE Vec3 tangent_to_light(const SceneView& scene, const LightSample& light, Vec3 from, Vec3 normal,
                                 Float v, Float& angle) {
    angle = splat(0.0f);
    Vec3 out = zero3();
    const auto take = [&](Mask lanes, Vec3 direction, Float its_angle) {
        out = select(lanes, direction, out);
        angle = select(lanes, its_angle, angle);
    };
    const auto to_section = [&](Mask lanes, const PlaneSection& line) {
        Float its_angle;
        const Vec3 direction = direction_to_section(line, normal, v, its_angle);
        take(lanes, direction, its_angle);
    };
    const Mask on_face = light.active & (light.face >= 0), on_row = light.active & (light.row >= 0);
    if (any(on_row)) {
        const LightRow l = gather_light(scene.lights, select(on_row, light.row, splat(0)));
        const auto is = [&](LightKind k) { return on_row & (light.kind == splat(k)); };
        const Vec3 center = l.position - from;
        const Mask rectangle = is(kRectangleLight), ellipse = is(kEllipseLight);
        if (any(rectangle))
            to_section(rectangle,
                       section_of_polygon<4>({center - l.axis_x - l.axis_y, center + l.axis_x - l.axis_y,
                                              center + l.axis_x + l.axis_y, center - l.axis_x + l.axis_y},
                                             normal));
        if (any(ellipse)) to_section(ellipse, section_of_ellipse(center, l.axis_x, l.axis_y, normal));
        const Mask round = on_row & ~rectangle & ~ellipse;
        if (any(round)) {
            Float its_angle;
            const LightBall ball = ball_around(l, is(kConeLight), from);
            const Vec3 direction = tangent_to_ball(ball, normal, v, its_angle);
            take(round, direction, its_angle);
        }
    }
    if (any(on_face)) {
        const Triangle t = gather_triangle(scene, select(on_face, light.face, splat(0)));
        to_section(on_face, section_of_polygon<3>({t.p0 - from, t.p1 - from, t.p2 - from}, normal));
    }
    return out;
}

}  // namespace edgegrad::EDGEGRAD_ISA
