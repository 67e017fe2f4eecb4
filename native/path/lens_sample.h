// The point of the lens through which a sample's ray goes.
#pragma once

#include "path/camera_projection.h"
#include "path/stream.h"

namespace edgegrad::EDGEGRAD_ISA {

// The two random numbers of the point.
EG_INLINE NumberPair lens_numbers(const CameraView& camera, const PathIndex& random) {
    if (camera.aperture_radius > 0.0f) return sobol_pair(random, kPairLens);
    return {splat(0.5f), splat(0.5f)};
}

EG_INLINE LensPoint lens_of(const CameraView& camera, Float u, Float v) {
    LensPoint lens = {splat(0.0f), splat(0.0f)};
    if (camera.aperture_radius > 0.0f) aperture_point(camera, u, v, lens.x, lens.y);
    return lens;
}

EG_INLINE LensPoint lens_of(const CameraView& camera, const PathIndex& random) {
    const NumberPair numbers = lens_numbers(camera, random);
    return lens_of(camera, numbers.u, numbers.v);
}

}  // namespace edgegrad::EDGEGRAD_ISA
