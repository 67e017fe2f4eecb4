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
    const Int one = splat(static_cast<int>(kDiffuseRay));
    if (kind == 0) {
        const Int sum = (all & 255) + ((all >> 8) & 255) + ((all >> 16) & 255);
        const Int least = select(known == splat(static_cast<int>(kCameraRay)), splat(0), one);
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
            // Write a result
            case TextureOp::OUTPUT:
                row[data] = select(active, r.in(0), row[data]);
                break;
            // Read the shading point
            case TextureOp::POSITION:
                r.out(point.position);
                break;
            case TextureOp::NORMAL:
                r.out(point.normal);
                break;
            case TextureOp::TRUE_NORMAL:
                r.out(point.true_normal);
                break;
            case TextureOp::INCOMING:
                r.out(point.view);
                break;
            case TextureOp::BACKFACING:
                r.out(truth(point.backside));
                break;
            case TextureOp::RAY_KIND:
                r.out(truth(point.ray_kind == data));
                break;
            case TextureOp::RAY_BOUNCES:
                r.out(to_float(bounces_so_far(point, data)));
                break;
            case TextureOp::RAY_LENGTH:
                r.out(point.history.length);
                break;
            // Read attributes, images and tables
            case TextureOp::ATTRIBUTE:
                r.out(surface_attribute(scene, data, field, face, instance, point.b1, point.b2,
                                        point.position));
                break;
            case TextureOp::IMAGE:
                r.out(lookup_image(textures, data, r.in(0), r.in(1)));
                break;
            case TextureOp::LOOKUP:
                r.out(lookup_table(textures, data, r.in(0)));
                break;
            // Compute arithmetic operations
            case TextureOp::ADD:
                r.out(r.in(0) + r.in(1));
                break;
            case TextureOp::SUBTRACT:
                r.out(r.in(0) - r.in(1));
                break;
            case TextureOp::MULTIPLY:
                r.out(r.in(0) * r.in(1));
                break;
            case TextureOp::DIVIDE:
                r.out(safe_divide(r.in(0), r.in(1)));
                break;
            case TextureOp::MULTIPLY_ADD:
                r.out(r.in(0) * r.in(1) + r.in(2));
                break;
            case TextureOp::AFFINE:
                r.out(r.in(0) * r.in(1) + r.in(2) * r.in(3) + r.in(4) * r.in(5) + r.in(6));
                break;
            case TextureOp::MINIMUM:
                r.out(min(r.in(0), r.in(1)));
                break;
            case TextureOp::MAXIMUM:
                r.out(max(r.in(0), r.in(1)));
                break;
            case TextureOp::CLAMP:
                r.out(clamp(r.in(0), r.in(1), r.in(2)));
                break;
            // Compare and select
            case TextureOp::LESS_THAN:
                r.out(truth(r.in(0) < r.in(1)));
                break;
            case TextureOp::GREATER_THAN:
                r.out(truth(r.in(0) > r.in(1)));
                break;
            case TextureOp::EQUAL:
                r.out(truth(r.in(0) == r.in(1)));
                break;
            case TextureOp::SELECT:
                r.out(select(r.in(0) != 0.0f, r.in(1), r.in(2)));
                break;
            // Compute elementary functions
            case TextureOp::ABSOLUTE:
                r.out(abs(r.in(0)));
                break;
            case TextureOp::SIGN:
                r.out(truth(r.in(0) > 0.0f) - truth(r.in(0) < 0.0f));
                break;
            case TextureOp::FLOOR:
                r.out(floor(r.in(0)));
                break;
            case TextureOp::CEIL:
                r.out(ceil(r.in(0)));
                break;
            case TextureOp::SQRT:
                r.out(sqrt(max(r.in(0), 0.0f)));
                break;
            case TextureOp::INVERSE_SQRT: {
                const Float a = r.in(0);
                r.out(select(a > 0.0f, 1.0f / sqrt(max(a, 1e-38f)), 0.0f));
                break;
            }
            case TextureOp::SQUARE_SCALE:
                r.out(square_scale(r.in3()));
                break;
            case TextureOp::POWER:
                r.out(safe_power(r.in(0), r.in(1)));
                break;
            case TextureOp::LOG: {
                const Float a = r.in(0);
                r.out(select(a > 0.0f, log(a), 0.0f));
                break;
            }
            case TextureOp::EXPONENT:
                r.out(exp(r.in(0)));
                break;
            case TextureOp::MODULO:
                r.out(fmod(r.in(0), r.in(1)));
                break;
            case TextureOp::SINE:
                r.out(sin(r.in(0)));
                break;
            case TextureOp::COSINE:
                r.out(cos(r.in(0)));
                break;
            case TextureOp::TANGENT: {
                Float s, c;
                sincos(r.in(0), s, c);
                r.out(s / c);
                break;
            }
            case TextureOp::ARCSINE:
                r.out(asin(r.in(0)));
                break;
            case TextureOp::ARCCOSINE:
                r.out(acos(r.in(0)));
                break;
            case TextureOp::ARCTAN2:
                r.out(atan2(r.in(0), r.in(1)));
                break;
            case TextureOp::SINH:
                r.out(sinh(r.in(0)));
                break;
            case TextureOp::COSH:
                r.out(cosh(r.in(0)));
                break;
            case TextureOp::TANH:
                r.out(tanh(r.in(0)));
                break;
            // Evaluate Fresnel reflectance and colour conversions
            case TextureOp::FRESNEL:
                r.out(fresnel_dielectric(r.in(0), r.in(1)));
                break;
            case TextureOp::RGB_TO_HSV:
                r.out(rgb_to_hsv(r.in3()));
                break;
            case TextureOp::HSV_TO_RGB:
                r.out(hsv_to_rgb(r.in3()));
                break;
            case TextureOp::RGB_TO_HSL:
                r.out(rgb_to_hsl(r.in3()));
                break;
            case TextureOp::HSL_TO_RGB:
                r.out(hsl_to_rgb(r.in3()));
                break;
            // Evaluate procedural textures
            case TextureOp::CHECKER:
                r.out(checker(r.in3()));
                break;
            case TextureOp::WHITE_NOISE: {
                const Float x[4] = {r.in(0), r.in(1), r.in(2), r.in(3)};
                Float out[3] = {};
                white_noise(data, x, out);
                r.out(Vec3{out[0], out[1], out[2]});
                break;
            }
            case TextureOp::NOISE:
                run_noise(r);
                break;
            case TextureOp::BRICK:
                run_brick(r);
                break;
            case TextureOp::VORONOI:
                run_voronoi(r);
                break;
            // Evaluate bump and normal maps
            case TextureOp::SURFACE_TANGENT:
                r.out(bump_tangent(point.true_normal));
                break;
            case TextureOp::BARYCENTRICS:
                r.out(shifted_barycentrics(scene, face, point, r.in3(), data != 0));
                break;
            case TextureOp::ATTRIBUTE_AT: {
                // in 2 to 4: the shift of the point, mirrored as that of its barycentrics (bump.h)
                const Vec3 shift{r.in(2), r.in(3), r.in(4)};
                const Mask back = point.backside & (r.in(5) != 0.0f);
                r.out(surface_attribute(scene, data, field, face, instance, r.in(0), r.in(1),
                                        point.position + select(back, -shift, shift)));
                break;
            }
            case TextureOp::BUMP:
                r.out(bumped_normal(point.true_normal, r.in3(), r.in(3), r.in(4), r.in(5)));
                break;
            case TextureOp::NORMAL_MAP: {
                const UvMap map = {splat(data & 0xffff), splat(data >> 16)};
                r.out(mapped_normal(scene, active, map, point, r.in3(), r.in(3)));
                break;
            }
        }
    }
}

}  // namespace edgegrad::EDGEGRAD_ISA
