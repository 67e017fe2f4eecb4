// The interpreter of texture programs. It is compiled once for each instruction set (CMakeLists.txt),
// separately from the kernels, because it takes as long to compile as they do.
#include "texture/program.h"

#include <limits>

#include "scene/textures/opcodes.h"
#include "texture/bump.h"
#include "texture/color.h"
#include "texture/field_grid.h"
#include "texture/image.h"
#include "texture/normal_map.h"
#include "texture/procedural.h"
#include "texture/registers.h"

namespace edgegrad::EDGEGRAD_ISA {

namespace {

// Unpolarized reflectance of a smooth dielectric with the relative refractive index eta.
EG_INLINE Float fresnel_dielectric(Float cosine, Float eta) {
    const Float c = abs(cosine);
    const Float g2 = eta * eta - 1.0f + c * c;
    const Float g = sqrt(max(g2, 0.0f));
    const Float a = (g - c) / (g + c), b = (c * (g + c) - 1.0f) / (c * (g - c) + 1.0f);
    return select(g2 > 0.0f, 0.5f * a * a * (1.0f + b * b), 1.0f);
}

// a^b; 1 for b = 0, 0 for a = 0, and 0 for negative a and fractional b.
EG_INLINE Float safe_power(Float a, Float b) {
    const Float whole = trunc(b);
    const Float y = pow_positive(select(a == 0.0f, splat(1.0f), abs(a)), b);
    const Mask odd = (whole - 2.0f * floor(0.5f * whole)) != 0.0f;
    const Float negative = select(whole == b, select(odd, -y, y), 0.0f);
    const Float r = select(a < 0.0f, negative, select(a == 0.0f, splat(0.0f), y));
    return select(b == 0.0f, splat(1.0f), r);
}

// 0 where the result does not exist.
EG_INLINE Float safe_inverse_sqrt(Float a) { return select(a > 0.0f, 1.0f / sqrt(max(a, 1e-38f)), 0.0f); }
EG_INLINE Float safe_log(Float a) { return select(a > 0.0f, log(a), 0.0f); }

EG_INLINE Float tangent(Float a) {
    Float s, c;
    sincos(a, s, c);
    return s / c;
}

EG_INLINE Float truth(Mask m) { return select(m, splat(1.0f), 0.0f); }

// A power of two that a vector is multiplied by before it is divided by its length, so that floats hold its
// square and the derivative of that; 0 where they do not hold the square itself.
EG_INLINE Float square_scale(Vec3 v) {
    const Float square = dot(detach(v), detach(v));
    return select(square < 0x1p64f, splat(1.0f),
                  select(square <= std::numeric_limits<float>::max(), splat(0x1p-32f), 0.0f));
}

// Bounces of one kind: 0 for all kinds of scattering, else 1 + place of the count.
EG_INLINE Int bounces_so_far(const TexturePoint& point, int32_t kind) {
    const Int all = point.history.bounces, known = point.ray_kind;
    const Int one = splat(kDiffuseRay);
    if (kind == 0) {
        const Int sum = (all & 255) + ((all >> 8) & 255) + ((all >> 16) & 255);
        const Int least = select(known == splat(kCameraRay), splat(0), one);
        return select(all != splat(-1), sum, least);
    }
    const Int count = (all >> (8 * (kind - 1))) & 255;
    return select(all != splat(-1), count, select(known == splat(kind), kind < 4 ? one : splat(0), splat(0)));
}

// An attribute of the surfaces that the lanes have hit: of meshes at barycentrics, of fields at a position.
EG_INLINE Color4 surface_attribute(const SceneView& scene, int32_t number, Mask field, Int face, Int instance,
                                   Float b1, Float b2, Vec3 position) {
    if (!any(field)) return lookup_attribute(scene.textures, number, face, instance, b1, b2);
    const Color4 on_fields = lookup_grid(scene, number, field, face, position);
    Color4 r = lookup_attribute(scene.textures, number, select(field, splat(-1), face), instance, b1, b2);
    for (int k = 0; k < 4; ++k) r.c[k] = select(field, on_fields.c[k], r.c[k]);
    return r;
}

// An operation of the loop below that only returns a value.
#define EG_VALUE(op, value) \
    case TextureOp::op:     \
        r.out(value);       \
        break;

}  // namespace

void interpret(const SceneView& scene, const Mask& active, int32_t program, const TexturePoint& point,
               Float* row) {
    const TextureView& textures = scene.textures;
    TextureRegisters r;
    r.constants = textures.constants;
    // Faces of inactive lanes may belong to no mesh of the scene.
    const Int face = select(active, point.face, splat(0));
    const Int instance = select(active, point.instance, splat(-1));
    const Mask field = on_field(scene, active, point.face);
    const TextureInstruction* end = textures.code + textures.program_first[program + 1];
    for (r.at = textures.code + textures.program_first[program]; r.at != end; ++r.at) {
        const int32_t data = r.at->data;
        switch (static_cast<TextureOp>(r.at->op)) {
            // Read the shading point
            EG_VALUE(POSITION, point.position)
            EG_VALUE(NORMAL, point.normal)
            EG_VALUE(TRUE_NORMAL, point.true_normal)
            EG_VALUE(INCOMING, point.view)
            EG_VALUE(BACKFACING, truth(point.backside))
            EG_VALUE(RAY_KIND, truth(point.ray_kind == data))
            EG_VALUE(RAY_BOUNCES, to_float(bounces_so_far(point, data)))
            EG_VALUE(RAY_LENGTH, point.history.length)
            // Read attributes, images and tables
            EG_VALUE(ATTRIBUTE, surface_attribute(scene, data, field, face, instance, point.b1, point.b2,
                                                  point.position))
            EG_VALUE(IMAGE, lookup_image(textures, data, r.in(0), r.in(1)))
            EG_VALUE(LOOKUP, lookup_table(textures, data, r.in(0)))
            // Compute arithmetic operations
            EG_VALUE(ADD, r.in(0) + r.in(1))
            EG_VALUE(SUBTRACT, r.in(0) - r.in(1))
            EG_VALUE(MULTIPLY, r.in(0) * r.in(1))
            EG_VALUE(DIVIDE, safe_divide(r.in(0), r.in(1)))
            EG_VALUE(MULTIPLY_ADD, r.in(0) * r.in(1) + r.in(2))
            EG_VALUE(AFFINE, r.in(0) * r.in(1) + r.in(2) * r.in(3) + r.in(4) * r.in(5) + r.in(6))
            EG_VALUE(MINIMUM, min(r.in(0), r.in(1)))
            EG_VALUE(MAXIMUM, max(r.in(0), r.in(1)))
            EG_VALUE(CLAMP, clamp(r.in(0), r.in(1), r.in(2)))
            // Compare and select
            EG_VALUE(LESS_THAN, truth(r.in(0) < r.in(1)))
            EG_VALUE(GREATER_THAN, truth(r.in(0) > r.in(1)))
            EG_VALUE(EQUAL, truth(r.in(0) == r.in(1)))
            EG_VALUE(SELECT, select(r.in(0) != 0.0f, r.in(1), r.in(2)))
            // Compute elementary functions
            EG_VALUE(ABSOLUTE, abs(r.in(0)))
            EG_VALUE(SIGN, truth(r.in(0) > 0.0f) - truth(r.in(0) < 0.0f))
            EG_VALUE(FLOOR, floor(r.in(0)))
            EG_VALUE(CEIL, ceil(r.in(0)))
            EG_VALUE(SQRT, sqrt(max(r.in(0), 0.0f)))
            EG_VALUE(INVERSE_SQRT, safe_inverse_sqrt(r.in(0)))
            EG_VALUE(SQUARE_SCALE, square_scale(r.in3()))
            EG_VALUE(POWER, safe_power(r.in(0), r.in(1)))
            EG_VALUE(LOG, safe_log(r.in(0)))
            EG_VALUE(EXPONENT, exp(r.in(0)))
            EG_VALUE(MODULO, fmod(r.in(0), r.in(1)))
            EG_VALUE(SINE, sin(r.in(0)))
            EG_VALUE(COSINE, cos(r.in(0)))
            EG_VALUE(TANGENT, tangent(r.in(0)))
            EG_VALUE(ARCSINE, asin(r.in(0)))
            EG_VALUE(ARCCOSINE, acos(r.in(0)))
            EG_VALUE(ARCTAN2, atan2(r.in(0), r.in(1)))
            EG_VALUE(SINH, sinh(r.in(0)))
            EG_VALUE(COSH, cosh(r.in(0)))
            EG_VALUE(TANH, tanh(r.in(0)))
            // Evaluate Fresnel reflectance and colour conversions
            EG_VALUE(FRESNEL, fresnel_dielectric(r.in(0), r.in(1)))
            EG_VALUE(RGB_TO_HSV, rgb_to_hsv(r.in3()))
            EG_VALUE(HSV_TO_RGB, hsv_to_rgb(r.in3()))
            EG_VALUE(RGB_TO_HSL, rgb_to_hsl(r.in3()))
            EG_VALUE(HSL_TO_RGB, hsl_to_rgb(r.in3()))
            // Evaluate procedural textures
            EG_VALUE(CHECKER, checker(r.in3()))
            EG_VALUE(WHITE_NOISE, white_noise(r))
            EG_VALUE(NOISE, noise(r))
            EG_VALUE(BRICK, brick(r))
            EG_VALUE(VORONOI, voronoi(r))
            // Evaluate bump and normal maps
            EG_VALUE(SURFACE_TANGENT, bump_tangent(point.true_normal))
            EG_VALUE(BARYCENTRICS, shifted_barycentrics(scene, face, point, r.in3(), data != 0))
            EG_VALUE(BUMP, bumped_normal(point.true_normal, r.in3(), r.in(3), r.in(4), r.in(5)))
            case TextureOp::ATTRIBUTE_AT: {
                // in 2 to 4: the shift of the point, mirrored as that of its barycentrics (bump.h)
                const Vec3 shift{r.in(2), r.in(3), r.in(4)};
                const Mask back = point.backside & (r.in(5) != 0.0f);
                r.out(surface_attribute(scene, data, field, face, instance, r.in(0), r.in(1),
                                        point.position + select(back, -shift, shift)));
                break;
            }
            case TextureOp::NORMAL_MAP: {
                const UvMap map = {splat(data & 0xffff), splat(data >> 16)};
                r.out(mapped_normal(scene, active, map, point, r.in3(), r.in(3)));
                break;
            }
            case TextureOp::OUTPUT:
                row[data] = select(active, r.in(0), row[data]);
                break;
        }
    }
}
#undef EG_VALUE

}  // namespace edgegrad::EDGEGRAD_ISA
