// Choice of lobes where only the roughness of some lobes is requested (derivations, M).
//
// The picture chooses lobes by their albedos, so the gloss of a dielectric over a diffuse base gets few of
// the samples. The derivative by its roughness comes almost only from the gloss. In addition, the scores of a
// lobe's samples nearly cancel when the samples are evenly distributed. A sample that another lobe takes
// leaves a gap in that distribution.
#pragma once

#include "shading/bsdf/closures.h"

namespace edgegrad::EDGEGRAD_ISA {

// Least share of the samples that the requested lobes get: for the last rays of paths, and for others, whose
// incoming light has derivatives too.
constexpr float kShareOfLast = 0.99f, kShareOfOthers = 0.5f;

// Favours the `lobes` (bits) of the mask's lanes.
EG_INLINE void favour(Bsdf& f, Mask m, int32_t lobes, Mask last) {
    Float sum = splat(0.0f);
    Mask favoured[kLobes];
    for (int k = 0; k < kLobes; ++k) {
        favoured[k] = splat(0);
        if (!f.any_lobe[k] || !(lobes >> k & 1)) continue;
        Microfacets& g = k == kMirrorLobe ? f.mirror.facets : k == kCoatLobe ? f.coat.facets : f.glass.facets;
        favoured[k] = m & ~is_smooth(g);
        g.by_score = favoured[k] & ~(g.beckmann | g.phong);  // the scores are those of GGX normals
        sum = sum + select(favoured[k], f.probability[k], splat(0.0f));
    }
    const Float share = max(sum, select(last, splat(kShareOfLast), splat(kShareOfOthers)));
    const Mask there = sum > 0.0f;
    const Float more = select(there, share / max(sum, 1e-30f), 1.0f);
    const Float less = select(there & (sum < 1.0f), (1.0f - share) / max(1.0f - sum, 1e-30f), 1.0f);
    for (int k = 0; k < kLobes; ++k)
        if (f.any_lobe[k]) f.probability[k] = f.probability[k] * select(favoured[k], more, less);
}

}  // namespace edgegrad::EDGEGRAD_ISA
