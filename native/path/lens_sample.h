// The point of the lens through which a sample's ray goes.
#pragma once

#include "path/camera_projection.h"
#include "path/stream.h"

namespace edgegrad::EDGEGRAD_ISA {

EG_INLINE LensPoint lens_of(const CameraView& camera, const PathIndex& random) {
    LensPoint lens = {splat(0.0f), splat(0.0f)};
    if (camera.aperture_radius > 0.0f) {
        Float u, v;
        sobol_pair(random.stream, random.sample, kPairLens, u, v);
        aperture_point(camera, u, v, lens.x, lens.y);
    }
    return lens;
}

}  // namespace edgegrad::EDGEGRAD_ISA
