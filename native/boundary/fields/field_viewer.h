// The camera and lights without size as viewers of outlines of distance fields.
#pragma once

#include "scene/view.h"
#include "sdf/outline_point.h"

namespace edgegrad {

// A point of the aperture, whose half width is 1, as a viewer of its own: the point (0, 0) is the camera
// without a lens.
struct LensPlace {
    float x, y;
};
// The camera's aperture at the fractions (u, v), uniformly, as camera rays sample it (scene/aperture.h).
LensPlace lens_place(const CameraView& camera, double u, double v);

FieldViewer camera_viewer(const FieldView& field, const CameraView& camera, LensPlace lens);
// `row`: a light without size, in the light table.
FieldViewer light_viewer(const FieldView& field, const LightView& lights, int32_t row);

}  // namespace edgegrad
