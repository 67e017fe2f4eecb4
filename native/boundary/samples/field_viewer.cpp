#include "boundary/samples/field_viewer.h"

namespace edgegrad {

FieldViewer camera_viewer(const FieldView& field, const CameraView& camera) {
    const bool parallel = camera.kind == kOrthographic;
    double from[3];
    for (int c = 0; c < 3; ++c)
        from[c] = static_cast<double>(parallel ? -camera.back[c] : camera.position[c]);
    return parallel ? viewer_along(field, from) : viewer_at(field, from);
}

}  // namespace edgegrad
