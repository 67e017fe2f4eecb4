// Positions of the camera's floats in their row (the first kCameraFloats of CameraView;
// core/tables/camera.py).
#pragma once

namespace edgegrad {

enum CameraFloat {
    kCameraPosition = 0,
    kCameraRight = 3,
    kCameraUp = 6,
    kCameraBack = 9,
    kCameraFocal = 12,
    kCameraPixelAspect = 13,
    kCameraPrincipal = 14,
    kCameraPanorama = 16,
    kCameraApertureRadius = 20,
    kCameraFocusDistance = 21,
    kCameraApertureRotation = 22,
    kCameraApertureRatio = 23
};

}  // namespace edgegrad
