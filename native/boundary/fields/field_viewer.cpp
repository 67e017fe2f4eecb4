#include "boundary/fields/field_viewer.h"

#include <cmath>
#include <numbers>

#include "scene/aperture.h"

namespace edgegrad {

namespace {

struct ApertureMath {
    using Number = double;
    static double read(const float* a) { return static_cast<double>(*a); }
    static double floor(double a) { return std::floor(a); }
    static double sqrt(double a) { return std::sqrt(a); }
    static void turn(double a, double& sine, double& cosine) {
        sine = std::sin(2.0 * std::numbers::pi * a), cosine = std::cos(2.0 * std::numbers::pi * a);
    }
};

}  // namespace

LensPlace lens_place(const CameraView& camera, double u, double v) {
    double x, y;
    aperture_point<ApertureMath>(camera, u, v, x, y);
    return {static_cast<float>(x), static_cast<float>(y)};
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
