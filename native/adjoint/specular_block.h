// Perfect mirrors and smooth interfaces as one block. Light that leaves along wo arrives from
//   w = A(c) n + B wo,  c = n.wo,  and is multiplied by value(c).
// For reflection A = 2c, B = -1; for refraction A = c/eta - cos(theta_t), B = -1/eta. The weights are
// constants. Layered closures, whose weights change with the view, are recorded by generic operations.
#pragma once

#include "adjoint/blocks.h"
#include "shading/bsdf/perfect_lobes.h"
#include "shading/surface_shader.h"

namespace edgegrad::EDGEGRAD_ISA {

struct SpecularBlock {
    static constexpr int kResults = 6;
    int32_t first;
    Nodes3 normal, view;
    RawVec3 n, v;
    raw::Float along, along_slope, across;  // A, dA/dc, B
    RawVec3 slope;                          // derivative of the value by c

    void backward(raw::Float* a) const {
        const RawVec3 direction = read(a, first), value = read(a, first + 3);
        const raw::Mask live = nonzero(direction) | nonzero(value);
        if (!raw::any(live)) return;
        const raw::Float cosine = dot(n, direction) * along_slope + dot(slope, value);
        add(a, normal, live, direction * along + v * cosine);
        add(a, view, live, direction * across + n * cosine);
    }
    void forward(raw::Float* a) const {
        const RawVec3 tilt = read(a, normal), turn = read(a, view);
        const raw::Mask live = nonzero(tilt) | nonzero(turn);
        const raw::Float cosine = dot(tilt, v) + dot(n, turn);
        write(a, first, live, tilt * along + turn * across + n * (along_slope * cosine));
        write(a, first + 3, live, slope * cosine);
    }
};

// Returns whether the active lanes' closures are of this kind, so that only the normal and the view change.
EG_INLINE bool plainly_specular(const Shader& shader, Mask active) {
    if (any(active & ~scatters_plainly(shader.kind, shader.flags))) return false;
    constexpr int places[] = {kBaseColor, kBaseColor + 1, kBaseColor + 2, kRoughness, kIor, kAnisotropy};
    for (int place : places)
        if (shader.row[place].node >= 0) return false;
    return true;
}

// Light scattered by the perfect lobes of active lanes.
inline Specular plain_specular(Mask active, const SurfacePoint& x, Vec3 view, const Shader& shader,
                               Vec3 normal, Int lobe, Mask transmitted) {
    const Vec3 mirror = valid_mirror_normal(normal, x.normal, view);
    const Interface glass =
        plain_interface(shader.kind, shader.color(kBaseColor), shader.row[kIor], x.side < 0.0f);
    const Specular fixed =
        scatter_plainly(glass, constant3(values(mirror)), constant3(values(view)), lobe, transmitted);
    if (!taped(nodes(mirror)) && !taped(nodes(view))) return fixed;

    SpecularBlock& block = current_tape->new_block<SpecularBlock>();
    block.normal = nodes(mirror), block.view = nodes(view);
    block.n = values(mirror), block.v = values(view);
    const Mask interface = active & (lobe == splat(kInterfaceLobe)), through = interface & transmitted;
    const raw::Float one = raw::splat(1.0f), c = dot(block.n, block.v), eta = glass.eta.value;
    // g = eta cos(theta_t); dg/dc = c/g.
    const raw::Float bending = bending_cosine(glass, constant(c)).value;
    const raw::Float bending_slope = raw::select(bending == c, one, -one);
    const raw::Float inverse_eta = one / eta, g = raw::sqrt(raw::max(eta * eta - (1.0f - c * c), 0.0f));
    const raw::Float inverse_g = finite_inverse(g);
    const auto pick = [&](raw::Float a, raw::Float b) {
        return raw::select(active, raw::select(through, a, b), 0.0f);
    };
    block.along = pick((bending - g) * inverse_eta, 2.0f * c);
    block.along_slope = pick((bending_slope - c * inverse_g) * inverse_eta, raw::splat(2.0f));
    block.across = pick(-inverse_eta, raw::splat(-1.0f));
    // The Fresnel reflectance of |c| needs no rescaling, because f0 comes from the same index.
    const raw::Float facing = raw::select(c < 0.0f, -one, one);
    const raw::Float fall = facing * reflectance_fall(raw::abs(c), eta, g, inverse_g);
    const raw::Mask splits = interface & (g > 0.0f) & ~glass.refracts_only;
    const RawVec3 tint = values(glass.transmission), weight = select(through, tint, raw_zero3() - tint);
    block.slope = weight * raw::select(splits, fall, 0.0f);
    return {results(values(fixed.wi), block.first), results(values(fixed.value), block.first + 3)};
}

}  // namespace edgegrad::EDGEGRAD_ISA
