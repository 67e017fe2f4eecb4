// The projection of line segments of the scene into the picture.
#pragma once

#include <functional>
#include <optional>

#include "scene/view.h"
#include "util/double_vector.h"

namespace edgegrad {

// The region that any pixel may see: the frame between the clip distances, enlarged by the pixel filter's
// support and by the blur of depth of field.
class PictureFrame {
 public:
    explicit PictureFrame(const CameraView& camera);

    // A part of a segment in the frame. u is 0 at the first end of the segment and 1 at the other. `pixels`
    // is an upper estimate of its projected length over the lens. (x, y) is the middle of the projection.
    struct EdgeSegment {
        double u0, u1, pixels, x, y;
    };
    // Calls visit(segment) for the visible parts of the segment from a to b. There is at most one, except for
    // panoramas, whose pictures bend lines.
    template <typename Visit>
    void visit_segments(Vector a, Vector b, const Visit& visit) const {
        if (is_panorama(camera_.kind)) return panorama_segments(a, b, visit);
        const EdgeSegment segment = flat_segment(a, b);
        if (segment.u0 < segment.u1) visit(segment);
    }

    // Bounds in pixels of where a point may be seen. None if it may be seen anywhere.
    struct Bounds {
        double low[2], high[2];
    };
    std::optional<Bounds> around(Vector point) const;

    // The direction, of any length, of the ray from the lens centre through a point.
    Vector ray_through(Vector point) const;
    // The largest difference between that direction and the directions from other points of the lens.
    double lens_reach() const;
    // By how many pixels the filter extends beyond the frame.
    double margin() const { return margin_; }
    // Whether the camera may bend lines or blur points.
    bool bends_or_blurs() const { return is_panorama(camera_.kind) || blur_x_ != 0.0 || blur_y_ != 0.0; }

 private:
    // In homogeneous coordinates (x h, y h, h) all clip planes are linear along a segment. h is the depth z,
    // or 1 for orthographic cameras. A point of the lens shifts the projection by at most blur |z/F - 1|, F
    // the focus distance.
    struct Place {
        double x, y, z, h, blur_x, blur_y;
    };
    Place place(Vector point) const;
    EdgeSegment flat_segment(Vector a, Vector b) const;  // u0 > u1 if nothing is in the frame
    // Where a ray in a direction of any length meets the picture of a panorama, pixels. Equirectangular
    // pictures repeat with each full turn in x, which starts anywhere.
    struct PicturePlace {
        double x, y;
    };
    PicturePlace panorama_place(Vector direction) const;
    // The radius of a fisheye's picture at an angle, in units of the focal length.
    double radius_at(double angle) const;
    void panorama_segments(Vector a, Vector b, const std::function<void(const EdgeSegment&)>& visit) const;

    const CameraView& camera_;
    Vector position_, right_, up_, back_;
    double margin_;           // of the filter, pixels
    double blur_x_, blur_y_;  // of depth of field at infinite depth, times the focus distance, pixels
};

}  // namespace edgegrad
