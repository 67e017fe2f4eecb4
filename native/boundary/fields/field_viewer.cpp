#include "boundary/fields/field_viewer.h"

namespace edgegrad {

FieldViewer camera_viewer(const FieldView& field, const CameraView& camera) {
    const bool parallel = camera.kind == kOrthographic;
    double from[3];
    for (int c = 0; c < 3; ++c)
        from[c] = static_cast<double>(parallel ? -camera.back[c] : camera.position[c]);
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
