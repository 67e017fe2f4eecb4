#include "boundary/fields/field_viewer.h"

#include <cmath>
#include <numbers>

namespace edgegrad {

LensPlace aperture_place(const CameraView& c, double u, double v) {
    constexpr double kTurn = 2.0 * std::numbers::pi;
    double x, y;
    if (c.aperture_blades >= 3) {
        const double sides = c.aperture_blades, side = std::floor(u * sides), r = std::sqrt(u * sides - side),
                     first = kTurn * side / sides, last = kTurn * (side + 1.0) / sides;
        const double a = r * (std::cos(first) * (1.0 - v) + std::cos(last) * v),
                     b = r * (std::sin(first) * (1.0 - v) + std::sin(last) * v);
        const double turn = static_cast<double>(c.aperture_rotation) - 0.5 * kTurn / sides;
        x = std::cos(turn) * a - std::sin(turn) * b;
        y = std::sin(turn) * a + std::cos(turn) * b;
    } else {
        x = std::sqrt(u) * std::cos(kTurn * v);
        y = std::sqrt(u) * std::sin(kTurn * v);
    }
    return {static_cast<float>(x / static_cast<double>(c.aperture_ratio)), static_cast<float>(y)};
}

FieldViewer camera_viewer(const FieldView& field, const CameraView& camera, LensPlace lens) {
    const bool parallel = camera.kind == kOrthographic;
    double from[3];
    for (int c = 0; c < 3; ++c) {
        from[c] = static_cast<double>(parallel ? -camera.back[c] : camera.position[c]);
        if (!(camera.aperture_radius > 0.0f)) continue;
        // Parallel rays of a point of the lens are inclined, so that they meet the others in the plane of
        // focus
        const double shift =
            static_cast<double>(camera.aperture_radius) *
            (static_cast<double>(camera.right[c]) * lens.x + static_cast<double>(camera.up[c]) * lens.y);
        from[c] += parallel ? -shift / static_cast<double>(camera.focus_distance) : shift;
    }
    return parallel ? viewer_along(field, from) : viewer_at(field, from);
}

FieldViewer light_viewer(const FieldView& field, const LightView& lights, int32_t row) {
    const bool distant = lights.kind[lights.light_of_row[row]] == kDirectionLight;
    const float* at = lights.params + kLightParams * static_cast<int64_t>(row) +
                      (distant ? kLightDirection : kLightPosition);
    const double from[3] = {at[0], at[1], at[2]};
    return distant ? viewer_along(field, from) : viewer_at(field, from);
}

}  // namespace edgegrad
