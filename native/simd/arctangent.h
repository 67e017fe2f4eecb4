// Inverse trigonometric functions of packets.
#pragma once

#include "simd/packet.h"

namespace edgegrad::EDGEGRAD_ISA {

// Angle of (x, y) for y >= 0, in [0, pi]; 0 for (0, 0). Reduced to tangents below tan(pi/8), then a minimax
// polynomial (relative error below 2e-7).
EG_INLINE Float upper_angle(Float y, Float x) {
    const Float ax = abs(x);
    const Mask steep = y > ax;
    const Float numerator = select(steep, ax, y), denominator = select(steep, y, ax);
    const Mask large = numerator > denominator * 0.41421356f;
    const Float t = select(large, numerator - denominator, numerator) /
                    max(select(large, numerator + denominator, denominator), 1e-37f);
    const Float t2 = t * t;
    Float angle = t + t * t2 *
                          (-3.33329491539e-1f +
                           t2 * (1.99777106478e-1f + t2 * (-1.38776856032e-1f + t2 * 8.05374449538e-2f)));
    angle = select(large, angle + 0.785398163f, angle);
    angle = select(steep, 1.57079633f - angle, angle);
    return select(x < 0.0f, 3.14159265f - angle, angle);
}

}  // namespace edgegrad::EDGEGRAD_ISA
