#include "boundary/curves/picture_frame.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace edgegrad {
namespace {

struct Range {
    double low = 0.0, high = 1.0;

    // Restricts the range to where the linear function with the values v0 at 0 and v1 at 1 is not negative.
    void clip(double v0, double v1) {
        if (v0 < 0.0 && v1 < 0.0) high = -1.0;
        if (v0 < 0.0) low = std::max(low, v0 / (v0 - v1));
        if (v1 < 0.0) high = std::min(high, v0 / (v0 - v1));
    }
    bool empty() const { return !(low < high); }
};

// Restricts the range to where v + |w| is not negative, for linear functions v and w. This is the hull of the
// ranges where v + w or v - w is not negative.
void clip_blurred(Range& range, const double (&v)[2], const double (&w)[2]) {
    Range more = range, less = range;
    more.clip(v[0] + w[0], v[1] + w[1]);
    less.clip(v[0] - w[0], v[1] - w[1]);
    if (more.empty() || less.empty()) {
        range = more.empty() ? less : more;
        return;
    }
    range.low = std::min(more.low, less.low);
    range.high = std::max(more.high, less.high);
}

using Ends = double[2];

// The part from u0 to u1 of a segment whose ends project to (x, y)/h.
PictureFrame::EdgeSegment seen_segment(double u0, double u1, const Ends& x, const Ends& y, const Ends& h,
                                       const Ends& blur_x, const Ends& blur_y) {
    double sx[2], sy[2], bx[2], by[2];
    for (int k = 0; k < 2; ++k) {
        const double u = k ? u1 : u0, over = 1.0 / std::max(h[0] + u * (h[1] - h[0]), 1e-12);
        sx[k] = (x[0] + u * (x[1] - x[0])) * over;
        sy[k] = (y[0] + u * (y[1] - y[0])) * over;
        bx[k] = (blur_x[0] + u * (blur_x[1] - blur_x[0])) * over;
        by[k] = (blur_y[0] + u * (blur_y[1] - blur_y[0])) * over;
    }
    const auto size = [](double dx, double dy) { return std::sqrt(dx * dx + dy * dy); };
    // A segment that points at the lens centre projects to a point from there, but not from the lens border.
    const double pixels = size(sx[1] - sx[0], sy[1] - sy[0]) + size(bx[1] - bx[0], by[1] - by[0]);
    return {u0, u1, pixels, 0.5 * (sx[0] + sx[1]), 0.5 * (sy[0] + sy[1])};
}

}  // namespace

PictureFrame::PictureFrame(const CameraView& c)
    : camera_(c),
      position_(vector_at(c.position)),
      right_(vector_at(c.right)),
      up_(vector_at(c.up)),
      back_(vector_at(c.back)),
      margin_(c.filter ? std::max(0.0, static_cast<double>(c.filter[kFilterSize]) - 0.5) : 0.0),
      blur_x_(static_cast<double>(c.focal * c.aperture_radius) / std::max(1e-6f, c.aperture_ratio)),
      blur_y_(static_cast<double>(c.focal * c.aperture_radius) / c.pixel_aspect) {}

Vector PictureFrame::ray_through(Vector point) const {
    return camera_.kind == kOrthographic ? back_ * -1.0 : point - position_;
}

double PictureFrame::lens_reach() const {
    if (is_panorama(camera_.kind)) return 0.0;
    const double radius =
        camera_.aperture_radius / std::min(1.0, std::max(1e-6, static_cast<double>(camera_.aperture_ratio)));
    return camera_.kind == kOrthographic ? radius / camera_.focus_distance : radius;
}

PictureFrame::Place PictureFrame::place(Vector point) const {
    const CameraView& c = camera_;
    const Vector to = point - position_;
    Place p{};
    p.z = -dot(back_, to);
    p.h = c.kind == kOrthographic ? 1.0 : p.z;
    p.x = c.focal * dot(right_, to) + c.principal[0] * p.h;
    p.y = -static_cast<double>(c.focal / c.pixel_aspect) * dot(up_, to) + c.principal[1] * p.h;
    const double defocus = p.z / c.focus_distance - 1.0;
    p.blur_x = blur_x_ * defocus, p.blur_y = blur_y_ * defocus;
    return p;
}

std::optional<PictureFrame::Bounds> PictureFrame::around(Vector point) const {
    if (is_panorama(camera_.kind)) return std::nullopt;
    const Place p = place(point);
    if (!(p.z > std::max(1e-12, static_cast<double>(camera_.clip_start)))) return std::nullopt;
    const double x = p.x / p.h, y = p.y / p.h, wide = std::abs(p.blur_x) / p.h,
                 high = std::abs(p.blur_y) / p.h;
    return Bounds{{x - wide, y - high}, {x + wide, y + high}};
}

PictureFrame::EdgeSegment PictureFrame::flat_segment(Vector a, Vector b) const {
    const CameraView& c = camera_;
    double x[2], y[2], z[2], h[2], blur_x[2], blur_y[2];
    const Place ends[2] = {place(a), place(b)};
    for (int k = 0; k < 2; ++k) {
        x[k] = ends[k].x, y[k] = ends[k].y, z[k] = ends[k].z, h[k] = ends[k].h;
        blur_x[k] = ends[k].blur_x, blur_y[k] = ends[k].blur_y;
    }
    // Most segments of fine meshes lie completely in the frame.
    bool whole = blur_x_ == 0.0 && blur_y_ == 0.0;
    for (int k = 0; k < 2; ++k)
        whole &= z[k] > c.clip_start && z[k] < c.clip_end && x[k] > 0.0 && x[k] < c.width * h[k] &&
                 y[k] > 0.0 && y[k] < c.height * h[k];
    Range range;
    if (whole) return seen_segment(range.low, range.high, x, y, h, blur_x, blur_y);
    // Clip against the near and far planes, then against the blurred frame
    range.clip(z[0] - c.clip_start, z[1] - c.clip_start);
    range.clip(c.clip_end - z[0], c.clip_end - z[1]);
    const auto within = [&](const double (&v)[2], double size, const double (&blur)[2]) {
        const double low[2] = {v[0] + margin_ * h[0], v[1] + margin_ * h[1]};
        const double high[2] = {(size + margin_) * h[0] - v[0], (size + margin_) * h[1] - v[1]};
        clip_blurred(range, low, blur);
        clip_blurred(range, high, blur);
    };
    if (!range.empty()) within(x, c.width, blur_x);
    if (!range.empty()) within(y, c.height, blur_y);
    if (range.empty()) return {1.0, 0.0, 0.0, 0.0, 0.0};
    return seen_segment(range.low, range.high, x, y, h, blur_x, blur_y);
}

double PictureFrame::radius_at(double angle) const {
    const CameraView& c = camera_;
    if (c.kind == kEquisolidFisheye) return 2.0 * std::sin(0.5 * angle);
    // The angle grows with the radius: halve the interval
    const auto angle_at = [&c](double radius) {
        double sum = 0.0;
        for (int i = 4; i >= 0; --i) sum = sum * radius + c.fisheye[i];
        return sum;
    };
    double low = 0.0, high = static_cast<double>(c.disc) / c.focal;
    if (angle > angle_at(high)) return 2.0 * high;
    for (int k = 0; k < 40; ++k) {
        const double middle = 0.5 * (low + high);
        (angle_at(middle) < angle ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

PictureFrame::PicturePlace PictureFrame::panorama_place(Vector d) const {
    const CameraView& c = camera_;
    const double x = dot(right_, d), y = dot(up_, d), z = -dot(back_, d);
    if (c.kind == kEquirectangular) {
        const double latitude = std::asin(std::clamp(y / length(d), -1.0, 1.0));
        const double fy = (latitude - c.panorama[2]) / (c.panorama[3] - c.panorama[2]);
        const double per_longitude = c.full_width / static_cast<double>(c.panorama[1] - c.panorama[0]);
        return {std::atan2(x, z) * per_longitude, (1.0 - fy) * c.full_height - c.window_y};
    }
    const double level = std::hypot(x, y);
    const double scale = c.focal * radius_at(std::atan2(level, z)) / std::max(level, 1e-30);
    return {c.principal[0] + scale * x, c.principal[1] - scale * y / c.pixel_aspect};
}

void PictureFrame::panorama_segments(Vector a, Vector b,
                                     const std::function<void(const EdgeSegment&)>& visit) const {
    constexpr double kLongest = 0.05;  // radians
    const CameraView& c = camera_;
    const Vector p = a - position_, q = b - position_;
    const double near = length(p), far = length(q);
    const double angle = std::atan2(length(cross(p, q)), dot(p, q));
    if (!(angle > 0.0)) return;
    const bool flat = is_fisheye(c.kind);
    const double turn =
        2.0 * std::numbers::pi * c.full_width / static_cast<double>(c.panorama[1] - c.panorama[0]);
    const double high = static_cast<double>(c.panorama[3] - c.panorama[2]);
    struct Place {
        double u;
        PicturePlace at;
    };
    // The position at the angle `at` from a.
    const auto place = [&](double at) {
        const double from_a = std::sin(angle - at) * far, from_b = std::sin(at) * near;
        const double u = at <= 0.0 ? 0.0 : at >= angle ? 1.0 : from_b / (from_a + from_b);
        return Place{u, panorama_place(p * (1.0 - u) + q * u)};
    };
    const auto in_disc = [&](const PicturePlace& s, double slack) {
        return std::hypot(s.x - c.principal[0], (s.y - c.principal[1]) * c.pixel_aspect) < c.disc + slack;
    };
    // The bent line between two steps leaves the box of its ends by less than half a step.
    const auto seen = [&](const PicturePlace& s, const PicturePlace& t, double step) {
        const double slack = margin_ + 1.0 + 0.5 * (flat ? step : kLongest * std::abs(c.full_height / high));
        const auto within = [slack](double from, double to, int size) {
            return std::max(from, to) > -slack && std::min(from, to) < size + slack;
        };
        if (!within(s.y, t.y, c.height)) return false;
        return !flat || (within(s.x, t.x, c.width) && (in_disc(s, slack) || in_disc(t, slack)));
    };
    const int count = static_cast<int>(std::ceil(angle / kLongest));
    // Walk along the segment in steps of equal angle
    Place from = place(0.0);
    for (int k = 0; k < count; ++k) {
        const Place to = place(angle * (k + 1) / count);
        const PicturePlace &s = from.at, &t = to.at;
        const double dx = flat ? t.x - s.x : std::remainder(t.x - s.x, turn), dy = t.y - s.y;
        const double step = std::hypot(dx, dy);
        if (seen(s, t, step)) visit({from.u, to.u, step, flat ? 0.5 * (s.x + t.x) : 0.0, 0.5 * (s.y + t.y)});
        from = to;
    }
}

}  // namespace edgegrad
