// A layer of fibres: Zeltner, Burley and Chiang 2022, "Practical Multiple-Scattering Sheen Using Linearly
// Transformed Cosines". Some lanes may be velvet instead (shading/bsdf/distributions/velvet.h).
#pragma once

#include "sampling/hemisphere.h"
#include "shading/bsdf/distributions/velvet.h"
#include "shading/bsdf/fresnel.h"
#include "shading/bsdf/tables/albedo_tables.h"
#include "shading/bsdf/tables/table_lookup.h"

namespace edgegrad::EDGEGRAD_ISA {

struct Sheen {
    Vec3 weight;  // albedo included
    Vec3 x, y;    // x: the viewer's direction along the surface
    Float a, b;   // w' = (a x + b z, a y, z) is cosine-distributed
    bool any_velvet = false;
    Mask velvet;
    Float sigma;  // of velvet
};

// The lobe of lanes that are no fibres.
EG_INLINE Sheen no_sheen(Vec3 n) {
    Sheen s;
    s.weight = zero3();
    basis(n, s.x, s.y);
    s.a = splat(1.0f), s.b = splat(0.0f);
    s.any_velvet = false, s.velvet = splat(0), s.sigma = splat(1.0f);
    return s;
}

EG_INLINE Sheen make_sheen(Vec3 n, Vec3 wo, Float cosine, Float roughness) {
    const TablePlace x = table_place(cosine, kSheenTable),
                     y = table_place(max(roughness, 1e-3f), kSheenTable);
    Sheen s;
    s.any_velvet = false, s.velvet = splat(0), s.sigma = splat(1.0f);
    s.a = max(table_plane(kSheenA, splat(0), x, y, kSheenTable), 1e-4f);
    s.b = table_plane(kSheenB, splat(0), x, y, kSheenTable);
    const Vec3 along = wo - n * dot(n, wo);
    const Float length2 = dot(along, along);
    Vec3 unused;
    basis(n, s.x, unused);
    s.x = select(length2 > 1e-12f, along * (1.0f / sqrt(max(length2, 1e-12f))), s.x);
    s.y = cross(n, s.x);
    s.weight = splat3(table_plane(kSheenAlbedo, splat(0), x, y, kSheenTable));
    return s;
}

// Density of directions. Multiplied by `weight` it is f cos.
EG_INLINE Float sheen_density(const Sheen& s, Vec3 n, Vec3 wi) {
    const Float z = dot(n, wi), x = s.a * dot(s.x, wi) + s.b * z, y = s.a * dot(s.y, wi);
    const Float ratio = s.a / max(x * x + y * y + z * z, 1e-20f);
    return max(z, 0.0f) * ratio * ratio * kInvPi;
}

EG_INLINE Vec3 sample_sheen(const Sheen& s, Vec3 n, Float u, Float v) {
    Float sine, cosine;
    sincos_turn(v, sine, cosine);
    const Float r = sqrt(u), z = sqrt(max(1.0f - u, 1e-7f));
    const Vec3 w = s.x * ((r * cosine - s.b * z) / s.a) + s.y * (r * sine / s.a) + n * z;
    return w * (1.0f / sqrt(dot(w, w)));
}

}  // namespace edgegrad::EDGEGRAD_ISA
