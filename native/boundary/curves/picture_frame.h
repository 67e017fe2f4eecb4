// Where line segments of the scene are in the picture.
#pragma once

#include <functional>
#include <optional>

#include "scene/view.h"
#include "util/double_vector.h"

namespace edgegrad {

// Everything that some pixel may see: the frame, widened by what the pixel filters reach over it and by what
// depth of field blurs into it, between the clip distances.
class PictureFrame {
 public:
    explicit PictureFrame(const CameraView& camera);

    // A part of a segment that is in the frame: u runs from 0 at its first end to 1 at the other, `pixels` is
    // the part's length in the picture, seen from some point of the lens, (x, y) its middle there.
    struct EdgeSegment {
        double u0, u1, pixels, x, y;
    };
    // visit(piece) for the pieces of the segment from a to b. One at most, but for an equirectangular camera,
    // in whose pictures lines are bent.
    template <typename Visit>
    void pieces(Vector a, Vector b, const Visit& visit) const {
        if (camera_.kind == kEquirectangular) return panorama_segments(a, b, visit);
        const EdgeSegment piece = flat_segment(a, b);
        if (piece.u0 < piece.u1) visit(piece);
    }

    // Where in the frame a point may be seen, pixels; none: anywhere.
    struct Bounds {
        double low[2], high[2];
    };
    std::optional<Bounds> around(Vector point) const;

    // Direction of the ray through a point (from the middle of the lens), of any length.
    Vector ray_through(Vector point) const;
    // By how much the rays from other points of the lens differ from it.
    double lens_reach() const;
    // By how much the pixel filters reach over the frame, pixels.
    double margin() const { return margin_; }
    // Whether lines may be bent in the picture, or points be blurred.
    bool bends_or_blurs() const {
        return camera_.kind == kEquirectangular || blur_x_ != 0.0 || blur_y_ != 0.0;
    }

 private:
    // Every clip plane is linear along a segment in homogeneous coordinates: (x, y) times h, and h is the
    // depth z or, orthographic, 1. A lens point shifts the picture by at most blur |z/F - 1| times that.
    struct Place {
        double x, y, z, h, blur_x, blur_y;
    };
    Place place(Vector point) const;
    EdgeSegment flat_segment(Vector a, Vector b) const;  // empty where nothing of it is in the frame
    void panorama_segments(Vector a, Vector b, const std::function<void(const EdgeSegment&)>& visit) const;

    const CameraView& camera_;
    Vector position_, right_, up_, back_;
    double margin_;           // of the filter, pixels
    double blur_x_, blur_y_;  // of depth of field at infinite depth, times the focus distance, pixels
};

}  // namespace edgegrad
