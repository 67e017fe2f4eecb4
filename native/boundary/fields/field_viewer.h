// The camera and lights without size as viewers of outlines of distance fields.
#pragma once

#include "scene/view.h"
#include "sdf/outline_point.h"

namespace edgegrad {

// Whether all points of the lens see the same outlines.
inline bool sees_one_outline(const CameraView& camera) { return !(camera.aperture_radius > 0.0f); }

FieldViewer camera_viewer(const FieldView& field, const CameraView& camera);
// `row`: a light without size, in the light table.
FieldViewer light_viewer(const FieldView& field, const LightView& lights, int32_t row);

}  // namespace edgegrad
