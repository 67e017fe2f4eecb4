// The scattering of a surface towards one viewer: a fixed set of lobes, each with a weight per lane.
#pragma once

#include "shading/bsdf/distributions/sheen.h"
#include "shading/bsdf/interface.h"
#include "shading/bsdf/lobe.h"
#include "shading/bsdf/oren_nayar.h"
#include "shading/bsdf/sample.h"
#include "shading/bsdf/transmission_rim.h"

namespace edgegrad::EDGEGRAD_ISA {

struct Bsdf {
    Mask active;
    Vec3 normal, ng, wo;  // normals on the viewer's side
    Float cosine;         // normal . wo
    // local frame of mirrors and interfaces; the normal z is bent so that reflections are valid
    Vec3 x, y, z;
    Vec3 view;  // wo in that frame
    // The mirror's own frame is rotated about z. The half vector itself is rotated, not view and light: their
    // derivatives would be 1/alpha times larger and cancel almost completely.
    bool any_turned;
    Float turn_cosine, turn_sine;
    Vec3 turned_view;

    Vec3 diffuse;  // albedo
    OrenNayar oren_nayar;
    Float burley;  // roughness of Burley's diffuse model; < 0: another model
    bool any_oren_nayar, any_burley;
    Vec3 translucent;
    Reflection mirror, coat;
    Interface glass;
    Sheen sheen;
    Vec3 emission;

    bool any_lobe[kLobes];      // whether any lane has the lobe
    Float probability[kLobes];  // of sampling the lobe
};

// A surface without lobes.
EG_INLINE Bsdf no_bsdf(Mask active, Vec3 n, Vec3 ng, Vec3 wo) {
    Bsdf f;
    f.active = active;
    f.normal = n, f.ng = ng, f.wo = wo;
    f.cosine = dot(n, wo);
    f.diffuse = f.translucent = f.emission = zero3();
    f.any_oren_nayar = f.any_burley = f.any_turned = false;
    for (int k = 0; k < kLobes; ++k) {
        f.any_lobe[k] = false;
        f.probability[k] = splat(0.0f);
    }
    return f;
}

EG_INLINE Vec3 to_local(const Bsdf& f, Vec3 w) { return {dot(f.x, w), dot(f.y, w), dot(f.z, w)}; }
// Converts from the local frame to the mirror's own frame, and back.
EG_INLINE Vec3 turned(const Bsdf& f, Vec3 w) {
    if (!f.any_turned) return w;
    return {w.x * f.turn_cosine + w.y * f.turn_sine, w.y * f.turn_cosine - w.x * f.turn_sine, w.z};
}
EG_INLINE Vec3 turned_back(const Bsdf& f, Vec3 w) {
    if (!f.any_turned) return w;
    return {w.x * f.turn_cosine - w.y * f.turn_sine, w.x * f.turn_sine + w.y * f.turn_cosine, w.z};
}
EG_INLINE Vec3 to_world(const Bsdf& f, Vec3 w) { return f.x * w.x + f.y * w.y + f.z * w.z; }

}  // namespace edgegrad::EDGEGRAD_ISA
