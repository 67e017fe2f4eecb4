// Samples a point of an edge as seen from a surface point x, near a direction a that x's BSDF has sampled.
// This finds edges that cross x's glossy lobes.
//
// The tree of edges is descended with probabilities proportional to
//   (length * width of the wedge) / distance^2 * K,   K = 1/(1 + |w - a|^2/s^2)^2,
// for the directions w to a node. The probability is 0 if no edge of the node can be a silhouette. On the
// chosen segment the angle phi along the edge has a density proportional to (d^2 + s^2 + phi^2)^(-3/2), where
// d is the angle between a and the edge's line. The integral of this density and its inverse are elementary.
// a and s are random numbers like others, so the density is that of the point given a. With
// s^2 = 1/(pi p(a)), p the BSDF's density, K is as wide as a GGX lobe. If a is far from the centre of the
// lobe, p(a) is small and K wide enough to reach the centre.
#pragma once

#include "boundary/samples/segment_sampling.h"
#include "shading/lights/light_choice.h"

namespace edgegrad::EDGEGRAD_ISA {

struct LobeDirection {
    Vec3 position;  // x
    Vec3 towards;   // a
    Float width2;   // s^2
};

// The weight of a node. With d the vector to the node's centre and h the distance of the centre from the ray
// along a (larger behind x), |w - a| is about h/|d|. The node's radius widens K. The node can contain a
// silhouette only if a normal in its cone (half angle o) can be perpendicular to a direction in its cone of
// directions (half angle b): |d . axis|/|d| <= sin(o + b). The test uses the upper bound sin o + cos o
// radius/|d| of the right side.
EG_INLINE Float weigh_node(const NodePacket& n, const LobeDirection& around) {
    const Vec3 d = n.center - around.position;
    const Float d2 = max(dot(d, d), 1e-30f), along = dot(d, around.towards), r2 = n.radius * n.radius;
    const Float h2 = max(d2 - select(along < 0.0f, -along, along) * along, 0.0f);
    const Float inner = d2 * around.width2 + r2, outer = inner + h2;
    const Float over = abs(dot(d, n.axis)) - n.cos_o * n.radius, sine = n.sin_o + 1e-5f;
    const Mask possible = (n.cos_o <= 0.0f) | (d2 <= r2) | (over <= 0.0f) | (over * over <= sine * sine * d2);
    const Float k = inner / outer;
    return select(possible, n.power * k * k / max(d2, r2), 0.0f);
}

// A position between u0 and u1 on the line a + u t, and its density with respect to u. The whole edge is 0 to
// 1.
struct PlaceOnEdge {
    Mask active;
    Float u, density;
};

EG_INLINE PlaceOnEdge choose_place(const LobeDirection& around, Mask active, Vec3 a, Vec3 t, Float u0,
                                   Float u1, Float random) {
    // Measure the line in angles from its foot
    const Float length = max(sqrt(dot(t, t)), 1e-30f);
    const Vec3 along = t * (1.0f / length), from = a - around.position;
    const Float start = dot(from, along);
    const Vec3 foot = from - along * start;
    const Float height = sqrt(dot(foot, foot));
    const Float low = start + u0 * length, high = start + u1 * length;
    const Float phi_low = atan2(low, height), range = atan2(high, height) - phi_low;
    const Vec3 away = foot * (1.0f / max(height, 1e-30f));
    // Invert the integral of the density
    const Float middle = atan2(dot(around.towards, along), dot(around.towards, away));
    const Float off = dot(around.towards, cross(along, away));
    const Float s2 = around.width2 + off * off;
    const auto share = [&](Float phi) { return phi / sqrt(s2 + phi * phi); };
    const Float q0 = share(phi_low - middle), q1 = share(phi_low + range - middle);
    const Float q = q0 + random * (q1 - q0);
    // If the density is nearly flat, sample the angle uniformly. If the segment subtends a small angle,
    // sample the position uniformly.
    const Mask flat = q1 - q0 < 1e-3f, small = range < 2e-3f;
    const Float q2 = min(q * q, splat(0.9999999f));
    const Float peaked = clamp(middle + q * sqrt(s2 / (1.0f - q2)), phi_low, phi_low + range);
    const Float phi = select(flat, phi_low + random * range, peaked), d = phi - middle, r2 = s2 + d * d;
    const Float by_angle =
        select(flat, 1.0f / max(range, 1e-30f), s2 / (r2 * sqrt(r2) * max(q1 - q0, 1e-30f)));
    // Convert the angle to a position on the edge
    Float sine, cosine;
    sincos(phi, sine, cosine);
    const Float l =
        select(small, low + random * (high - low), clamp(height * sine / max(cosine, 1e-7f), low, high));
    PlaceOnEdge p;
    p.active = active & (height > 1e-6f * length);
    p.u = clamp((l - start) * (1.0f / length), u0, u1);
    p.density = select(small, 1.0f / max(u1 - u0, 1e-30f),
                       by_angle * length * height / max(height * height + l * l, 1e-30f));
    return p;
}

}  // namespace edgegrad::EDGEGRAD_ISA
