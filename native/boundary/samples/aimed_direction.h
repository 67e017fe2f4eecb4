// Directions aimed at the points that the cells of a grid list (tasks/boundary_task.h). The densities of
// directions about the points have heavy tails: about a direction d, 1/(s + b)^2 with s = 1 - cos of the
// angle to d, and b the value of s at the width of the peak. All directions are possible.
#pragma once

#include "simd/vector.h"
#include "tasks/boundary_task.h"

namespace edgegrad::EDGEGRAD_ISA {

// The fraction of samples that are aimed, at places where beams pass.
constexpr float kAimed = 0.5f;

// A point of an edge, and the points at which its cell aims.
struct Aim {
    Mask known;
    Int first;
    Vec3 from;
};

EG_INLINE Aim aim_from(const BeamGridView& grid, Mask active, Vec3 from) {
    Aim aim{splat(0), splat(0), from};
    if (!grid.slot) return aim;
    const auto place = [&](Float x, int k) EG_INLINE_LAMBDA { return (x - grid.low[k]) * grid.inverse; };
    const Vec3 at = {place(from.x, 0), place(from.y, 1), place(from.z, 2)};
    const auto within = [&](Float x, int k) EG_INLINE_LAMBDA {
        return (x >= 0.0f) & (x < static_cast<float>(grid.count[k]));
    };
    const auto index = [&](Float x, int k) EG_INLINE_LAMBDA { return to_index(x, 0, grid.count[k] - 1); };
    const Mask inside = active & within(at.x, 0) & within(at.y, 1) & within(at.z, 2);
    const Int cell = (index(at.z, 2) * grid.count[1] + index(at.y, 1)) * grid.count[0] + index(at.x, 0);
    const Int slot = gather(grid.slot, select(inside, cell, splat(0)));
    aim.known = inside & (slot >= 0);
    aim.first = select(aim.known, slot * kBeamTargets, splat(0));
    aim.known &= gather(grid.targets, aim.first * 4 + 3) > 0.0f;
    return aim;
}

// The unit direction to target k of the cell, and its width b.
EG_INLINE Vec3 direction_to_target(const BeamGridView& grid, const Aim& aim, Int k, Float& b) {
    const Int row = (aim.first + k) * 4;
    const auto column = [&](int c) EG_INLINE_LAMBDA { return gather(grid.targets, row + c); };
    b = column(3);
    return unit_vector(Vec3{column(0), column(1), column(2)} - aim.from);
}

EG_INLINE Vec3 aimed_direction(const BeamGridView& grid, const Aim& aim, Float u, Float v) {
    const Float place = v * static_cast<float>(kBeamTargets);
    const Int k = to_index(place, 0, kBeamTargets - 1);
    Float b;
    const Vec3 d = direction_to_target(grid, aim, k, b);
    const Float s = min(2.0f * b * u / (b + 2.0f * (1.0f - u)), splat(2.0f));
    const Float sine = sqrt(s * (2.0f - s));
    Vec3 across, up;
    basis(d, across, up);
    Float y, x;
    sincos_turn(min(max(place - to_float(k), 0.0f), splat(1.0f)), y, x);
    return d * (1.0f - s) + (across * x + up * y) * sine;
}

// The density of aimed_direction per solid angle.
EG_OUTLINE Float aimed_density(const BeamGridView& grid, const Aim& aim, Vec3 w) {
    Float sum = splat(0.0f);
    for (int k = 0; k < kBeamTargets; ++k) {
        Float b;
        const Vec3 off = w - direction_to_target(grid, aim, splat(k), b);
        const Float s = 0.5f * dot(off, off) + b;
        sum = sum + b * (2.0f + b) / (s * s);
    }
    constexpr float kFourPi = 12.5663706f;
    return sum * (1.0f / (kFourPi * static_cast<float>(kBeamTargets)));
}

// The numbers with which one of two strategies samples, of which the first takes the fraction kAimed of the
// lanes of `both`. Returns the lanes of the first.
EG_INLINE Mask take_aimed(Mask both, Float& v) {
    const Mask aimed = both & (v < kAimed);
    v = select(aimed, v * (1.0f / kAimed), select(both, (v - kAimed) * (1.0f / (1.0f - kAimed)), v));
    return aimed;
}

}  // namespace edgegrad::EDGEGRAD_ISA
