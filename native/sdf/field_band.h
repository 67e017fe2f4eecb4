// The band about the outline of a distance field in the picture, in which estimators that sample an area in
// the place of the outline take their samples (reparameterisation/near_miss.h).
#pragma once

namespace edgegrad {

struct FieldBand {
    float pixels = 0.0f;    // half of its width; 0: the field has no band
    float steepest = 0.0f;  // bound of the length of the field's gradient in grid coordinates
    // Where the field's second derivative along the ray, over the length of its gradient and per square of a
    // cell, is less, the band is narrower in proportion.
    float least_curvature = 0.0f;
};

}  // namespace edgegrad
