// Low-discrepancy samples: pairs of the Sobol' sequence, Owen-scrambled and shuffled by hashes.
//
// Burley 2020, "Practical Hash-based Owen Scrambling" (JCGT 9.4). Each pixel and each pair of dimensions has
// its own random nested scrambling and its own shuffled order. Pairs are thus independent of each other and
// stratified by themselves. A hash replaces tables, so that a sample is a pure function of (seed, pixel,
// index, pair), and results do not depend on the order of work.
#pragma once

#include "simd/packet.h"

namespace edgegrad::EDGEGRAD_ISA {

// The pairs of one camera sample, by purpose.
enum Pair : uint32_t {
    kPairPixel = 1,
    kPairLight = 2,
    kPairEnvironment = 3,
    kPairStrategy = 4,
    kPairLens = 5,
    kPairChain = 6  // surfaces between a boundary's segment and the camera
};

// The pairs at each vertex of a path.
enum VertexPair : uint32_t {
    kVertexDirection,    // the scattered direction
    kVertexLight,        // point of an emitter
    kVertexEnvironment,  // direction to the environment's image
    kVertexChoice,       // choice of closure and lobe
    kVertexSurvival,     // transparency, Russian roulette
    kVertexMedium,       // the distance to the next scattering event in a medium
    kVertexMediumLight   // the light near which that distance is sampled
};

// The hash lowbias32 (Wellons), of a number or a packet.
template <typename T>
EG_INLINE T hash(T x) {
    x ^= x >> 16;
    x *= 0x21f0aaadu;
    x ^= x >> 15;
    x *= 0xd35a2d97u;
    x ^= x >> 15;
    return x;
}

EG_INLINE UInt reverse_bits(UInt x) {
    x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
    x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
    x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
    x = ((x >> 8) & 0x00ff00ffu) | ((x & 0x00ff00ffu) << 8);
    return (x >> 16) | (x << 16);
}

// Nested uniform scrambling of a bit-reversed number (Laine and Karras 2011, constants by Vegdahl).
EG_INLINE UInt scramble_reversed(UInt x, UInt seed) {
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

// The second Sobol' dimension of index i, bit-reversed. Its matrix is Pascal's triangle mod 2: entry (r, c)
// is 1 iff the bits of r are a subset of those of c. Five butterfly steps apply it.
EG_INLINE UInt sobol_second_reversed(UInt i) {
    i ^= (i >> 1) & 0x55555555u;
    i ^= (i >> 2) & 0x33333333u;
    i ^= (i >> 4) & 0x0f0f0f0fu;
    i ^= (i >> 8) & 0x00ff00ffu;
    i ^= (i >> 16) & 0x0000ffffu;
    return i;
}

EG_INLINE Float to_unit(UInt x) { return to_float(bits(x >> 8)) * 5.9604645e-8f; }  // [0, 1)

// Index of a vertex' pair. The camera's pairs come first.
EG_INLINE UInt vertex_pair(Int vertex, VertexPair pair) {
    return bits(vertex) * 8u + (8u + static_cast<uint32_t>(pair));
}

// Sample `index` of the pair `pair` from the stream `stream` (a hash of seed and pixel), in [0, 1)^2.
EG_INLINE void sobol_pair(UInt stream, UInt index, UInt pair, Float& u, Float& v) {
    const UInt seed = hash(stream ^ (pair * 0x9e3779b9u));
    const UInt shuffled = reverse_bits(scramble_reversed(reverse_bits(index), seed));
    u = to_unit(reverse_bits(scramble_reversed(shuffled, hash(seed ^ 0x68bc21ebu))));
    v = to_unit(reverse_bits(scramble_reversed(sobol_second_reversed(shuffled), hash(seed ^ 0x02e5be93u))));
}
EG_INLINE void sobol_pair(UInt stream, UInt index, uint32_t pair, Float& u, Float& v) {
    sobol_pair(stream, index, splat(pair), u, v);
}

// The same of a path (path/stream.h).
struct NumberPair {
    Float u, v;
};
template <typename Index, typename Number>
EG_INLINE NumberPair sobol_pair(const Index& path, Number pair) {
    NumberPair n;
    sobol_pair(path.stream, path.sample, pair, n.u, n.v);
    return n;
}

}  // namespace edgegrad::EDGEGRAD_ISA
