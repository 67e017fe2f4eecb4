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
    kCameraFisheye = 20,
    kCameraDisc = 25,
    kCameraApertureRadius = 26,
    kCameraFocusDistance = 27,
    kCameraApertureRotation = 28,
    kCameraApertureRatio = 29
};

}  // namespace edgegrad
