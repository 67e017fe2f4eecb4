// Reflectance of surfaces under a thin film: interference of light in RGB, as in Cycles (Belcour and Barla
// 2017, "A Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence").
//
// The film's top reflects waves with the amplitude r12, the surface below it r23, and light goes to and fro
// between both. With q = -r12 r23, complex above metals, and Rs = (1 - R12)^2 R23 / (1 - R12 R23), the
// reflectance in a channel is
//   R12 + Rs + 2 (Rs - (1 - R12)) sum_m Re(q^m conj(S(m D))),   m = 1, 2, 3
// for each polarisation. D is the path difference of neighbouring waves and S the Fourier transform of the
// channel's sensitivity over frequencies (tables/make_film_table.py). Later terms are too small to matter.
// q is smooth where an amplitude changes its sign, as at Brewster's angle; its absolute value is not.
#pragma once

#include "shading/bsdf/fresnel.h"
#include "shading/bsdf/tables/albedo_tables.h"
#include "shading/bsdf/tables/table_lookup.h"

namespace edgegrad::EDGEGRAD_ISA {

struct Film {
    bool any;  // whether any lane has a film
    Mask there;
    Float thickness, ior;  // nm; relative to the viewer's side
};

EG_INLINE Film no_film() { return {false, splat(0), splat(0.0f), splat(1.0f)}; }

// Like Cycles, films up to 0.1 nm do not count, and the index of films below 1 nm approaches that of the
// viewer's side, since interference says nothing about single molecules.
EG_INLINE Film make_film(Mask m, Float thickness, Float ior) {
    const Float thin = saturate(thickness);
    const Mask there = m & (thickness > 0.1f);
    return {any(there), there, thickness,
            lerp(splat(1.0f), max(ior, 1e-5f), thin * thin * (3.0f - 2.0f * thin))};
}

EG_INLINE Film select_film(Mask m, const Film& a, const Film& b) {
    return {a.any || b.any, (a.there & m) | (b.there & ~m), select(m, a.thickness, b.thickness),
            select(m, a.ior, b.ior)};
}

// S(m D) of the channels.
struct FilmWaves {
    Vec3 real[3], imaginary[3];
};

EG_INLINE FilmWaves film_waves(Float difference) {
    constexpr float kPlaces = 6.28318531f / 60000.0f;  // of the table by nm
    FilmWaves w;
    for (int m = 0; m < 3; ++m) {
        const TablePlace x = table_place(difference * (kPlaces * static_cast<float>(m + 1)), kFilmTable);
        const auto row = [&](int k) { return table_row(kFilmSensitivity, splat(k * kFilmTable), x); };
        w.real[m] = {row(0), row(1), row(2)};
        w.imaginary[m] = {row(3), row(4), row(5)};
    }
    return w;
}

// The sum above for one polarisation and channel: from r12, R23 and q.
EG_INLINE Float film_sum(const Float (&real)[3], const Float (&imaginary)[3], Float top, Float bottom2,
                         Float q, Float q_imaginary) {
    const Float top2 = top * top, passed = 1.0f - top2;
    const Float back = passed * passed * bottom2 / max(1.0f - top2 * bottom2, 1e-6f);
    const Float factor = 2.0f * (back - passed);
    Float sum = top2 + back, a = q, b = q_imaginary;
    for (int m = 0; m < 3; ++m) {
        sum = sum + factor * (a * real[m] + b * imaginary[m]);
        const Float next = a * q - b * q_imaginary;
        b = a * q_imaginary + b * q;
        a = next;
    }
    return sum;
}

// Film on a dielectric of the relative index eta.
EG_OUTLINE Vec3 film_on_dielectric(const Film& film, Float cosine, Float eta) {
    const Amplitudes top = amplitudes(abs(cosine), film.ior);
    const Amplitudes bottom = amplitudes(top.refracted / film.ior, eta / film.ior);
    const FilmWaves waves = film_waves(2.0f * film.thickness * top.refracted);
    const auto channel = [&](Float Vec3::* c) {
        const Float real[] = {waves.real[0].*c, waves.real[1].*c, waves.real[2].*c};
        const Float none[] = {splat(0.0f), splat(0.0f), splat(0.0f)};
        const auto polarised = [&](Float a, Float b) {
            return film_sum(real, none, a, b * b, -a * b, splat(0.0f));
        };
        return saturate(0.5f * (polarised(top.s, bottom.s) + polarised(top.p, bottom.p)));
    };
    const Vec3 f = {channel(&Vec3::x), channel(&Vec3::y), channel(&Vec3::z)};
    return select(top.refracts & bottom.refracts, f, white());
}

// The same for a dielectric whose reflectance without a film is f0 at normal incidence, which changes that of
// the film the more the closer both are.
EG_INLINE Vec3 film_fresnel(const Film& film, Float cosine, Float eta, Vec3 f0) {
    const Vec3 f = film_on_dielectric(film, cosine, eta);
    const Float exact = f0_of_ior(eta);
    const auto scaled = [&](Float f, Float f0) {
        const Float share = saturate((1.0f - f) / (1.0f - min(exact, splat(0.999f))));
        return f * lerp(splat(1.0f), f0 / max(exact, 1e-5f), share);
    };
    return select(exact > 1e-5f, Vec3{scaled(f.x, f0.x), scaled(f.y, f0.y), scaled(f.z, f0.z)}, f);
}

// A film's boundary with a metal, seen from the film: the reflectance, and the phases of both polarisations
// as unit complex numbers. The metal has the reflectances f0 at normal incidence and `edge` at the cosine
// 1/7. Its complex index n + i k is estimated from them (Gulbrandsen 2014, "Artist Friendly Metallic
// Fresnel").
struct MetalBoundary {
    Float reflectance;
    Float s, s_imaginary, p, p_imaginary;
};

EG_INLINE MetalBoundary metal_boundary(Float film, Float c, Float f0, Float edge) {
    const Float r = clamp(f0, splat(1e-6f), splat(0.999f)), root = sqrt(r);
    const Float n = lerp((1.0f + root) / (1.0f - root), (1.0f - r) / (1.0f + r), edge);
    const Float more = n + 1.0f, less = n - 1.0f;
    const Float k2 = max((r * more * more - less * less) / (1.0f - r), 1e-6f), k = sqrt(k2);
    // F82's curve (f82_b), with reflectances from within the film
    const Float m = n / film, l2 = k2 / (film * film);
    const Float least = ((m - 1.0f) * (m - 1.0f) + l2) / ((m + 1.0f) * (m + 1.0f) + l2);
    constexpr float e = 6.0f / 7, e5 = e * e * e * e * e;
    const Float bend = (least + (1.0f - least) * e5 - edge) * (7.0f / (e5 * e));
    const Float away = saturate(1.0f - c), away5 = pow5(away);
    MetalBoundary out;
    out.reflectance =
        clamp(least + (1.0f - least) * away5 - bend * (c * away5 * away), splat(1e-6f), splat(1.0f));
    // Phases (Born and Wolf, Principles of Optics, 14.4.1)
    const Float n2 = n * n, both = 2.0f * n * k, squares = n2 - k2, film2 = film * film;
    const Float t = squares - film2 * (1.0f - c * c), length = sqrt(max(t * t + both * both, 1e-20f));
    const Float u = sqrt(max(0.5f * (length + t), 1e-12f)), v = sqrt(max(0.5f * (length - t), 1e-12f));
    const auto unit = [](Float real, Float imaginary, Float& a, Float& b) {
        const Float inverse = 1.0f / sqrt(max(real * real + imaginary * imaginary, 1e-20f));
        a = real * inverse, b = imaginary * inverse;
    };
    const Float fc = film * c, sum = u * u + v * v, absolute = (n2 + k2) * c;
    unit(fc * fc - sum, -2.0f * fc * v, out.s, out.s_imaginary);
    unit(absolute * absolute - film2 * sum, 2.0f * fc * (both * u - squares * v), out.p, out.p_imaginary);
    return out;
}

// Film on a metal with the F82-tint reflectance of f0 and b (f82).
EG_OUTLINE Vec3 film_on_metal(const Film& film, Float cosine, Vec3 f0, Vec3 b) {
    const Amplitudes top = amplitudes(abs(cosine), film.ior);
    const Float c = top.refracted / film.ior;
    const FilmWaves waves = film_waves(2.0f * film.thickness * top.refracted);
    const Vec3 edge = f82(splat(1.0f / 7), f0, b);
    const auto channel = [&](Float Vec3::* of) {
        const Float real[] = {waves.real[0].*of, waves.real[1].*of, waves.real[2].*of};
        const Float imaginary[] = {waves.imaginary[0].*of, waves.imaginary[1].*of, waves.imaginary[2].*of};
        const MetalBoundary m = metal_boundary(film.ior, c, f0.*of, edge.*of);
        const Float amplitude = sqrt(m.reflectance);
        const auto polarised = [&](Float a, Float phase, Float phase_imaginary) {
            const Float q = -a * amplitude;
            return film_sum(real, imaginary, a, m.reflectance, q * phase, q * phase_imaginary);
        };
        return saturate(0.5f * (polarised(top.s, m.s, m.s_imaginary) + polarised(top.p, m.p, m.p_imaginary)));
    };
    const Vec3 f = {channel(&Vec3::x), channel(&Vec3::y), channel(&Vec3::z)};
    return select(top.refracts, f, white());
}

}  // namespace edgegrad::EDGEGRAD_ISA
