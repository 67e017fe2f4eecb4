// What a surface scatters towards one viewer: a fixed set of lobes, each with a weight per lane.
#pragma once

#include "shading/bsdf/interface.h"
#include "shading/bsdf/lobe.h"
#include "shading/bsdf/oren_nayar.h"
#include "shading/bsdf/sample.h"
#include "shading/bsdf/sheen.h"
#include "shading/bsdf/transmission_rim.h"

namespace edgegrad::EDGEGRAD_ISA {

struct Bsdf {
    Mask active;
    Vec3 normal, ng, wo;  // normals on the viewer's side
    Float cosine;         // normal . wo
    Vec3 x, y, z;         // local frame of mirrors and interfaces, whose normal z gives valid reflections
    Vec3 view;            // wo in it
    // The mirror's own frame is turned about z. Half vectors are turned as such: of a lobe of width alpha the
    // turns of view and light have derivatives that cancel but for alpha.
    bool any_turned;
    Float turn_cosine, turn_sine;
    Vec3 turned_view;

    Vec3 diffuse;  // albedo
    OrenNayar oren_nayar;
    Float burley;  // roughness of Burley's diffuse model; < 0: not that
    bool any_oren_nayar, any_burley;
    Vec3 translucent;
    Reflection mirror, coat;
    Interface glass;
    Sheen sheen;
    Vec3 emission;

    bool any_lobe[kLobes];      // whether a lane has it
    Float probability[kLobes];  // of sampling it
};

// A surface without any lobe.
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
// From the local frame to the mirror's own, and back.
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
