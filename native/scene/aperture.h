// Points of the camera's aperture, for packets of rays and for numbers.
#pragma once

#include "scene/view.h"

namespace edgegrad {

// Samples a point on the unit aperture: a disk (concentric map, Shirley and Chiu 1997) or a regular polygon
// of `blades` sides with its corners on the unit circle. The width is divided by the aperture ratio. As in
// Cycles, the rotation's angle points to the middle of a side. `Math` has the functions floor, sqrt and turn
// (sine and cosine of a fraction of a turn in [0, 1)) of its Number, and reads floats of the camera: numbers
// that record derivatives know them by their addresses.
template <typename Math, typename Number = typename Math::Number>
[[gnu::always_inline]] inline void aperture_point(const CameraView& c, Number u, Number v, Number& x,
                                                  Number& y) {
    const auto fraction = [](Number a) __attribute__((always_inline)) { return a - Math::floor(a); };
    Number s, t;
    if (c.aperture_blades >= 3) {
        const float sides = static_cast<float>(c.aperture_blades);
        const Number side = Math::floor(u * sides);
        const Number r = Math::sqrt(u * sides - side);  // position within the triangle of one side
        Number s0, c0, s1, c1;
        Math::turn(side * (1.0f / sides), s0, c0);
        Math::turn(fraction((side + 1.0f) * (1.0f / sides)), s1, c1);
        x = r * (c0 * (1.0f - v) + c1 * v);
        y = r * (s0 * (1.0f - v) + s1 * v);
        Math::turn(fraction(Math::read(&c.aperture_rotation) * 0.159154943f - 0.5f / sides), s, t);
        const Number px = x;
        x = t * px - s * y;
        y = s * px + t * y;
    } else {
        Math::turn(v, s, t);
        const Number r = Math::sqrt(u);
        x = r * t;
        y = r * s;
    }
    x = x * (1.0f / Math::read(&c.aperture_ratio));
}

}  // namespace edgegrad
