// The interpreter of texture programs. It is compiled once for each instruction set (CMakeLists.txt),
// separately from the kernels, because it takes as long to compile as they do.
#include "texture/program.h"

#include <limits>

#include "scene/textures/opcodes.h"
#include "texture/color.h"
#include "texture/image.h"
#include "texture/noise.h"
#include "texture/normal_map.h"
#include "texture/voronoi.h"

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

// 1 where a checkerboard of unit cubes has its first colour.
EG_INLINE Float checker(Vec3 p) {
    const auto cell = [](Float x) { return floor((x + 0.000001f) * 0.999999f); };
    const Float half = 0.5f * (cell(p.x) + cell(p.y) + cell(p.z));
    return select(half == floor(half), splat(0.0f), 1.0f);
}

template <int N>
EG_INLINE NoisePoint<N> noise_point(const Float (&x)[4]) {
    NoisePoint<N> p;
    if constexpr (N == 1)
        p.x[0] = x[3];
    else
        for (int k = 0; k < N; ++k) p.x[k] = x[k];
    return p;
}

// Blender's White Noise Texture. Bits of `data`: dimensions - 1 (2 bits), whether a colour is requested.
EG_INLINE void white_noise(int32_t data, const Float (&x)[4], Float* out) {
    const Float one = splat(1.0f), two = splat(2.0f);
    const bool color = data & 4;
    switch (data & 3) {
        case 0:
            out[0] = hash1(x[3]);
            if (color) out[1] = hash2(x[3], one), out[2] = hash2(x[3], two);
            break;
        case 1:
            out[0] = hash2(x[0], x[1]);
            if (color) out[1] = hash3(x[0], x[1], one), out[2] = hash3(x[0], x[1], two);
            break;
        case 2:
            out[0] = hash3(x[0], x[1], x[2]);
            if (color) out[1] = hash4(x[0], x[1], x[2], one), out[2] = hash4(x[0], x[1], x[2], two);
            break;
        default:
            out[0] = hash4(x[0], x[1], x[2], x[3]);
            if (color) out[1] = hash4(x[2], x[0], x[3], x[1]), out[2] = hash4(x[3], x[2], x[1], x[0]);
    }
}

// The scalar registers of a running program, and the current instruction's access to them.
struct TextureRegisters {
    Float value[kTextureRegisters + 1];
    const float* constants;
    const TextureInstruction* at;

    EG_INLINE Float in(int k) const {
        const int32_t i = at->in[k];
        return i < 0 ? broadcast(constants + ~i) : value[i];
    }
    EG_INLINE Vec3 in3() const { return {in(0), in(1), in(2)}; }
    EG_INLINE void out(Float a) { value[at->out[0]] = a; }
    EG_INLINE void out(Vec3 a) {
        value[at->out[0]] = a.x;
        value[at->out[1]] = a.y;
        value[at->out[2]] = a.z;
    }
    EG_INLINE void out(const Color4& a) {
        for (int k = 0; k < 4; ++k) value[at->out[k]] = a.c[k];
    }
};

EG_INLINE Float truth(Mask m) { return select(m, splat(1.0f), 0.0f); }

// A power of two that a vector is multiplied by before it is divided by its length, so that floats hold its
// square and the derivative of that; 0 where they do not hold the square itself.
EG_INLINE Float square_scale(Vec3 v) {
    const Float square = dot(detach(v), detach(v));
    return select(square < 0x1p64f, splat(1.0f),
                  select(square <= std::numeric_limits<float>::max(), splat(0x1p-32f), 0.0f));
}

EG_INLINE void run_noise(TextureRegisters& r) {
    const int32_t data = r.at->data;
    const Float x[4] = {r.in(0), r.in(1), r.in(2), r.in(3)};
    const NoiseShape shape = {r.in(4), r.in(5), r.in(6), r.in(7), r.in(8), (data & 32) != 0};
    const Float distortion = r.in(9);
    const int32_t kind = (data >> 2) & 7;
    const bool color = data & 64;
    Float out[3] = {};
    switch (data & 3) {
        case 0:
            noise_texture<1>(kind, noise_point<1>(x), shape, distortion, color, out);
            break;
        case 1:
            noise_texture<2>(kind, noise_point<2>(x), shape, distortion, color, out);
            break;
        case 2:
            noise_texture<3>(kind, noise_point<3>(x), shape, distortion, color, out);
            break;
        default:
            noise_texture<4>(kind, noise_point<4>(x), shape, distortion, color, out);
    }
    r.out(Vec3{out[0], out[1], out[2]});
}

EG_INLINE void run_voronoi(TextureRegisters& r) {
    const int32_t data = r.at->data;
    const Float x[4] = {r.in(0), r.in(1), r.in(2), r.in(3)};
    const VoronoiShape shape = {(data >> 2) & 7, (data >> 5) & 3, (data >> 8) & 3, (data & 128) != 0,
                                r.in(4),         r.in(5),         r.in(6),         r.in(7),
                                r.in(8),         r.in(9)};
    Color4 out{};
    switch (data & 3) {
        case 0:
            voronoi_texture<1>(shape, noise_point<1>(x), out.c);
            break;
        case 1:
            voronoi_texture<2>(shape, noise_point<2>(x), out.c);
            break;
        case 2:
            voronoi_texture<3>(shape, noise_point<3>(x), out.c);
            break;
        default:
            voronoi_texture<4>(shape, noise_point<4>(x), out.c);
    }
    r.out(out);
}

// Blender's Brick Texture: the tint of the brick, and 1 in the mortar. `data`: the number of rows after which
// bricks are shifted, and (upper half) squashed.
EG_INLINE void run_brick(TextureRegisters& r) {
    const int32_t offset_rows = r.at->data & 0xffff, squash_rows = r.at->data >> 16;
    const Float x = r.in(0), y = r.in(1), mortar_size = r.in(2), mortar_smooth = r.in(3), bias = r.in(4);
    const Float height = r.in(6), shift = r.in(7), squash = r.in(8);
    Float width = r.in(5);
    const Float row = floor(y / height);
    const auto every = [&](int32_t n) { return wrap_index(to_int(row), n) == 0; };
    Float offset = splat(0.0f);
    if (offset_rows && squash_rows) {
        width = select(every(squash_rows), width * squash, width);
        offset = select(every(offset_rows), width * shift, 0.0f);
    }
    const Float brick = floor((x + offset) / width);
    const Float in_x = x + offset - width * brick, in_y = y - height * row;
    // An integer noise of row and brick.
    UInt n = (bits(to_int(row)) << 16) + (bits(to_int(brick)) & 0xffffu);
    n = (n + 1013u) & 0x7fffffffu;
    n = (n >> 13) ^ n;
    n = (n * (n * n * 60493u + 19990303u) + 1376312589u) & 0x7fffffffu;
    const Float tint = saturate(0.5f * (to_float(bits(n)) * (1.0f / 1073741824.0f)) + bias);
    const Float border = min(min(in_x, in_y), min(width - in_x, height - in_y));
    const Float t = saturate(safe_divide(1.0f - safe_divide(border, mortar_size), mortar_smooth));
    const Float soft = select(mortar_smooth == 0.0f, splat(1.0f), t * t * (3.0f - 2.0f * t));
    r.out(Vec3{tint, select(border >= mortar_size, splat(0.0f), soft), splat(0.0f)});
}

// A unit vector orthogonal to the normal n. Cycles takes the heights of bump maps along the same vector.
EG_INLINE Vec3 bump_tangent(Vec3 n) {
    const Mask diagonal = (n.x == n.y) & (n.x == n.z);
    const Vec3 a = {n.z - n.y, n.x - n.z, n.y - n.x};     // (1, 1, 1) x n
    const Vec3 b = {n.z - n.y, n.x + n.z, -(n.y + n.x)};  // (-1, 1, 1) x n
    return normalized_or(select(diagonal, b, a), zero3());
}

// The normal n, bent by a height with the slopes x and y along the surface's tangents (Mikkelsen 2010, "Bump
// Mapping Unparametrized Surfaces on the GPU"), and mixed with n.
EG_INLINE Vec3 bumped_normal(Vec3 surface, Vec3 n, Float x, Float y, Float strength) {
    const Vec3 a = bump_tangent(surface), b = cross(surface, a);
    const Float cosine = dot(n, surface);
    const Vec3 gradient = cross(b, n) * x + cross(n, a) * y;
    const Vec3 bent =
        normalized_or(n * abs(cosine) - gradient * select(cosine < 0.0f, splat(-1.0f), 1.0f), n);
    return normalized_or(bent * strength + n * (1.0f - strength), n);
}

// Barycentrics of the point at a distance `shift`, in the plane of the face, from the texture point.
// `mirrored`: on back sides, at the opposite distance. Cycles has it so for attributes, but not for
// positions.
EG_INLINE Vec3 shifted_barycentrics(const SceneView& scene, Int face, const TexturePoint& point, Vec3 shift,
                                    bool mirrored) {
    if (mirrored) shift = select(point.backside, -shift, shift);
    Triangle t = gather_triangle(scene, face);
    place_triangle(scene, point.instance, t);
    const Vec3 e1 = t.p1 - t.p0, e2 = t.p2 - t.p0, m = cross(e1, e2);
    const Float length = sqrt(dot(m, m));
    const Float inverse = 1.0f / select(length > 0.0f, length, 1.0f);
    const Vec3 n = m * inverse;
    // The gradients of the barycentrics are e2 x n / |m| and n x e1 / |m|.
    return {point.b1 + dot(cross(e2, n), shift) * inverse, point.b2 + dot(cross(n, e1), shift) * inverse,
            splat(0.0f)};
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
            // Read attributes, images and tables
            case TextureOp::ATTRIBUTE:
                r.out(lookup_attribute(textures, data, face, instance, point.b1, point.b2));
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
            case TextureOp::ATTRIBUTE_AT:
                r.out(lookup_attribute(textures, data, face, instance, r.in(0), r.in(1)));
                break;
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
