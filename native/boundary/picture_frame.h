// Where line segments of the scene are in the picture.
#pragma once

#include <functional>

#include "scene/vector.h"
#include "scene/view.h"

namespace edgegrad {

// Everything that some pixel may see: the frame, widened by what the pixel filters reach over it and by what
// depth of field blurs into it, between the clip distances.
class PictureFrame {
 public:
    explicit PictureFrame(const CameraView& camera);

    // visit(u0, u1, pixels) for the pieces of the segment from a to b that are in the frame: u runs from 0 at
    // a to 1 at b, `pixels` is the piece's length in the picture, seen from some point of the lens. One piece
    // at most, but for an equirectangular camera, in whose pictures lines are bent.
    using Visit = std::function<void(double u0, double u1, double pixels)>;
    void pieces(Vector a, Vector b, const Visit& visit) const;

    // Direction of the ray through a point (from the middle of the lens), of any length.
    Vector ray_through(Vector point) const;
    // By how much the rays from other points of the lens differ from it.
    double lens_reach() const;

 private:
    void flat_pieces(Vector a, Vector b, const Visit& visit) const;
    void panorama_pieces(Vector a, Vector b, const Visit& visit) const;

    const CameraView& camera_;
    Vector position_, right_, up_, back_;
    double margin_;           // of the filter, pixels
    double blur_x_, blur_y_;  // of depth of field at infinite depth, times the focus distance, pixels
};

}  // namespace edgegrad
