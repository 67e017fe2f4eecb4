// Voronoi textures in N = 1 to 4 dimensions (Cycles' voronoi.h, after Inigo Quilez): each cell of the unit
// grid has one point. Lanes may differ in every parameter.
#pragma once

#include "texture/noise.h"

namespace edgegrad::EDGEGRAD_ISA {

enum VoronoiFeature : int32_t { kF1, kF2, kSmoothF1, kDistanceToEdge, kSphereRadius };
enum VoronoiMetric : int32_t { kEuclidean, kManhattan, kChebychev, kMinkowski };
enum VoronoiOutput : int32_t { kDistanceOutput, kColorOutput, kPositionOutput };

struct VoronoiShape {
    int32_t feature, metric, output;
    bool normalize;
    Float detail, roughness, lacunarity, smoothness, exponent, randomness;
};

// Result of one octave: the distance, or the colour or position of the point found.
struct VoronoiOctave {
    Float distance;
    Float value[4];
};

template <int N>
EG_INLINE NoisePoint<N> operator+(NoisePoint<N> a, NoisePoint<N> b) {
    for (int k = 0; k < N; ++k) a.x[k] += b.x[k];
    return a;
}
template <int N>
EG_INLINE NoisePoint<N> operator-(NoisePoint<N> a, NoisePoint<N> b) {
    for (int k = 0; k < N; ++k) a.x[k] -= b.x[k];
    return a;
}
template <int N>
EG_INLINE NoisePoint<N> select(Mask m, NoisePoint<N> a, NoisePoint<N> b) {
    for (int k = 0; k < N; ++k) a.x[k] = select(m, a.x[k], b.x[k]);
    return a;
}
template <int N>
EG_INLINE Float dot(NoisePoint<N> a, NoisePoint<N> b) {
    Float r = a.x[0] * b.x[0];
    for (int k = 1; k < N; ++k) r += a.x[k] * b.x[k];
    return r;
}

// Hashes of a cell: the position of its point within the cell, and its colour (`count` values).
template <int N>
EG_INLINE void hash_cell_values(NoisePoint<N> cell, Float* out, int count) {
    if constexpr (N == 1) {
        const Float c = cell.x[0];
        out[0] = hash1(c);
        if (count > 1) out[1] = hash2(c, splat(1.0f)), out[2] = hash2(c, splat(2.0f));
    } else {
        UInt index[4] = {};
        for (int k = 0; k < N; ++k) index[k] = bits(to_int(cell.x[k]));
        if (N == 2 && count == 2) {
            const UInt two[2] = {index[0], index[1]};
            Float h[2];
            hash_cell<2>(two, h);
            out[0] = h[0], out[1] = h[1];
        } else if (N <= 3) {
            const UInt three[3] = {index[0], index[1], index[2]};
            Float h[3];
            hash_cell<3>(three, h);
            for (int k = 0; k < 3; ++k) out[k] = h[k];
        } else {
            Float h[4];
            hash_cell<4>(index, h);
            for (int k = 0; k < count; ++k) out[k] = h[k];
        }
    }
}

template <int N>
EG_INLINE NoisePoint<N> cell_point(NoisePoint<N> cell, NoisePoint<N> offset, Float randomness) {
    Float h[4];
    hash_cell_values<N>(cell + offset, h, N);
    for (int k = 0; k < N; ++k) offset.x[k] += h[k] * randomness;
    return offset;
}

// A point at `offset` from the cell of the coordinates, and its distance.
template <int N>
struct VoronoiPoint {
    NoisePoint<N> offset, place;
    Float distance;
};

template <int N>
EG_INLINE VoronoiPoint<N> select(Mask m, const VoronoiPoint<N>& a, const VoronoiPoint<N>& b) {
    return {select(m, a.offset, b.offset), select(m, a.place, b.place), select(m, a.distance, b.distance)};
}

template <int N>
EG_INLINE Float metric_distance(const VoronoiShape& s, NoisePoint<N> d) {
    if (N == 1 || s.metric == kEuclidean) return sqrt(dot(d, d));
    Float r = splat(0.0f);
    for (int k = 0; k < N; ++k) {
        const Float a = abs(d.x[k]);
        if (s.metric == kManhattan) r += a;
        if (s.metric == kChebychev) r = max(r, a);
        if (s.metric == kMinkowski) r += select(a > 0.0f, pow_positive(max(a, 1e-30f), s.exponent), 0.0f);
    }
    if (s.metric == kMinkowski) r = select(r > 0.0f, pow_positive(max(r, 1e-30f), 1.0f / s.exponent), 0.0f);
    return r;
}

// Calls visit(offset) for all cells at most `reach` away. The first axis varies fastest.
template <int N, typename Visit>
EG_INLINE void for_cells(int reach, Visit visit) {
    const int width = 2 * reach + 1;
    int count = 1;
    for (int k = 0; k < N; ++k) count *= width;
    for (int i = 0; i < count; ++i) {
        NoisePoint<N> offset;
        int rest = i;
        for (int k = 0; k < N; ++k) {
            offset.x[k] = splat(static_cast<float>(rest % width - reach));
            rest /= width;
        }
        visit(offset);
    }
}

template <int N>
EG_INLINE void fill_octave(const VoronoiShape& s, NoisePoint<N> cell, const VoronoiPoint<N>& p,
                           VoronoiOctave& r) {
    for (int k = 0; k < 4; ++k) r.value[k] = splat(0.0f);
    if (s.output == kColorOutput) hash_cell_values<N>(cell + p.offset, r.value, 3);
    if (s.output == kPositionOutput)
        for (int k = 0; k < N; ++k) r.value[N == 1 ? 3 : k] = cell.x[k] + p.place.x[k];
}

// Finds the nearest point (F1) or the second nearest point (F2).
template <int N>
EG_INLINE VoronoiOctave nearest_points(const VoronoiShape& s, NoisePoint<N> cell, NoisePoint<N> local,
                                       bool second) {
    VoronoiPoint<N> first{local, local, splat(1e30f)}, next = first;
    for_cells<N>(1, [&](NoisePoint<N> offset) EG_INLINE_LAMBDA {
        VoronoiPoint<N> here{offset, cell_point<N>(cell, offset, s.randomness), splat(0.0f)};
        here.distance = metric_distance<N>(s, here.place - local);
        const Mask nearer = here.distance < first.distance;
        if (second) next = select(nearer, first, select(here.distance < next.distance, here, next));
        first = select(nearer, here, first);
    });
    const VoronoiPoint<N>& found = second ? next : first;
    VoronoiOctave r;
    r.distance = found.distance;
    fill_octave<N>(s, cell, found, r);
    return r;
}

template <int N>
EG_INLINE VoronoiOctave smooth_nearest(const VoronoiShape& s, NoisePoint<N> cell, NoisePoint<N> local) {
    VoronoiOctave r{splat(0.0f), {}};
    bool started = false;
    for_cells<N>(2, [&](NoisePoint<N> offset) EG_INLINE_LAMBDA {
        const VoronoiPoint<N> here{offset, cell_point<N>(cell, offset, s.randomness), splat(0.0f)};
        const Float distance = metric_distance<N>(s, here.place - local);
        const Float t = saturate(0.5f + 0.5f * (r.distance - distance) / s.smoothness);
        const Float h = started ? t * t * (3.0f - 2.0f * t) : splat(1.0f);
        started = true;
        Float correction = s.smoothness * h * (1.0f - h);
        r.distance += h * (distance - r.distance) - correction;
        correction /= 1.0f + 3.0f * s.smoothness;
        VoronoiOctave value;
        fill_octave<N>(s, cell, here, value);
        for (int k = 0; k < 4; ++k) {
            // Positions are relative to the cell, because the weights do not sum to one.
            const Float base = s.output == kPositionOutput && (N == 1 ? k == 3 : k < N)
                                   ? cell.x[N == 1 ? 0 : (k < N ? k : 0)]
                                   : splat(0.0f);
            r.value[k] += h * (value.value[k] - base - r.value[k]) - correction;
        }
    });
    if (s.output == kPositionOutput)
        for (int k = 0; k < 4; ++k) {
            const bool used = N == 1 ? k == 3 : k < N;
            r.value[k] = used ? r.value[k] + cell.x[N == 1 ? 0 : (k < N ? k : 0)] : splat(0.0f);
        }
    return r;
}

template <int N>
EG_INLINE Float distance_to_edge(const VoronoiShape& s, NoisePoint<N> cell, NoisePoint<N> local) {
    if constexpr (N == 1) {
        const auto at = [&](float offset) {
            return cell_point<1>(cell, NoisePoint<1>{{splat(offset)}}, s.randomness).x[0];
        };
        const Float mid = at(0.0f);
        return min(abs(0.5f * (mid + at(-1.0f)) - local.x[0]), abs(0.5f * (mid + at(1.0f)) - local.x[0]));
    } else {
        NoisePoint<N> closest = local;
        Float least = splat(1e30f);
        for_cells<N>(1, [&](NoisePoint<N> offset) EG_INLINE_LAMBDA {
            const NoisePoint<N> to_point = cell_point<N>(cell, offset, s.randomness) - local;
            const Float distance = dot(to_point, to_point);
            closest = select(distance < least, to_point, closest);
            least = min(least, distance);
        });
        least = splat(1e30f);
        for_cells<N>(1, [&](NoisePoint<N> offset) EG_INLINE_LAMBDA {
            const NoisePoint<N> to_point = cell_point<N>(cell, offset, s.randomness) - local;
            const NoisePoint<N> across = to_point - closest;
            const Float length2 = dot(across, across);
            const Float edge = dot((closest + to_point) * splat(0.5f), across) / sqrt(max(length2, 1e-30f));
            least = select(length2 > 0.0001f, min(least, edge), least);
        });
        return least;
    }
}

// Half the distance between the nearest point and its own nearest neighbour.
template <int N>
EG_INLINE Float sphere_radius(const VoronoiShape& s, NoisePoint<N> cell, NoisePoint<N> local) {
    VoronoiPoint<N> first{local, local, splat(1e30f)};
    for_cells<N>(1, [&](NoisePoint<N> offset) EG_INLINE_LAMBDA {
        VoronoiPoint<N> here{offset, cell_point<N>(cell, offset, s.randomness), splat(0.0f)};
        here.distance = dot(here.place - local, here.place - local);
        first = select(here.distance < first.distance, here, first);
    });
    Float least = splat(1e30f);
    int index = 0, middle = 1;
    for (int k = 0; k < N; ++k) middle *= 3;
    for_cells<N>(1, [&](NoisePoint<N> offset) EG_INLINE_LAMBDA {
        if (index++ == middle / 2) return;
        const NoisePoint<N> apart = cell_point<N>(cell, offset + first.offset, s.randomness) - first.place;
        least = min(least, dot(apart, apart));
    });
    return 0.5f * sqrt(least);
}

template <int N>
EG_INLINE VoronoiOctave voronoi_octave(const VoronoiShape& s, NoisePoint<N> p) {
    NoisePoint<N> cell, local;
    for (int k = 0; k < N; ++k) {
        cell.x[k] = floor(p.x[k]);
        local.x[k] = p.x[k] - cell.x[k];
    }
    VoronoiOctave r{splat(0.0f), {}};
    switch (s.feature) {
        case kDistanceToEdge:
            r.distance = distance_to_edge<N>(s, cell, local);
            break;
        case kSphereRadius:
            r.distance = sphere_radius<N>(s, cell, local);
            break;
        case kF2:
            r = nearest_points<N>(s, cell, local, true);
            break;
        case kSmoothF1:
            if (any(s.smoothness > 0.0f)) {
                r = smooth_nearest<N>(s, cell, local);
                break;
            }
            [[fallthrough]];
        default:
            r = nearest_points<N>(s, cell, local, false);
    }
    return r;
}

// Blender's Voronoi Texture. The caller divides positions by its scale.
template <int N>
static __attribute__((noinline)) void voronoi_texture(const VoronoiShape& s, NoisePoint<N> p, Float* out) {
    const bool edge = s.feature == kDistanceToEdge;
    const Mask plain = (s.detail == 0.0f) | (s.roughness == 0.0f) | (s.feature == kSphereRadius ? -1 : 0);
    // The largest possible distance.
    NoisePoint<N> corner;
    for (int k = 0; k < N; ++k) corner.x[k] = 0.5f + 0.5f * s.randomness;
    const Float reach = edge ? corner.x[0] : metric_distance<N>(s, corner) * (s.feature == kF2 ? 2.0f : 1.0f);
    Float amplitude = splat(1.0f), scale = splat(1.0f);
    Float largest = edge ? reach : splat(0.0f), distance = splat(edge ? 8.0f : 0.0f);
    Float value[4] = {};
    for_octaves(select(plain, splat(0.0f), s.detail), true, [&](int k, Float share) EG_INLINE_LAMBDA {
        const VoronoiOctave o = voronoi_octave<N>(s, p * scale);
        const Float weight = select(plain, splat(1.0f), amplitude);
        if (edge) {
            const Float mixed = distance + weight * (min(distance, o.distance / scale) - distance);
            largest += share * weight * (reach / scale - largest);
            distance += share * (min(distance, mixed) - distance);
            if (k == 0) largest = select(plain, reach, largest);
        } else {
            largest += share * weight;
            distance += share * weight * o.distance;
            for (int c = 0; c < 4; ++c)
                value[c] += share * weight *
                            (s.output == kPositionOutput ? o.value[c] / scale - value[c] : o.value[c]);
        }
        if (k == 0) distance = select(plain, o.distance, distance);
        scale *= s.lacunarity;
        amplitude *= s.roughness;
    });
    if (s.normalize && s.feature != kSphereRadius) {
        distance /= edge ? largest : largest * reach;
        if (s.output == kColorOutput)
            for (int c = 0; c < 3; ++c) value[c] /= largest;
    }
    if (s.output == kDistanceOutput)
        out[0] = distance;
    else
        for (int c = 0; c < 4; ++c) out[c] = value[c];
}

}  // namespace edgegrad::EDGEGRAD_ISA
