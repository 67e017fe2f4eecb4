// Which lobes of a surface are sampled where only how wide some are is asked for (derivations, M).
//
// The picture picks lobes by their albedos, so that a dielectric's gloss over a diffuse base gets one sample
// of twenty. The derivative by its roughness comes from the gloss alone, but for little. And as the score of
// a lobe's samples sums up to next to nothing where they fill it evenly, one that another lobe takes leaves a
// hole: roughness_env at 4 samples, with 10, 5, 2, 1 and 0 % for the diffuse lobe, relative variance 1.10,
// 0.78, 0.54, 0.47 and 0.37 (even samples; the picture's 30 %: 1.93).
#pragma once

#include "shading/bsdf/closures.h"

namespace edgegrad::EDGEGRAD_ISA {

// Least share of the asked lobes among a surface's samples: of a path's last rays, and of others, whose light
// has derivatives of its own (a room of one dielectric, 5 segments, variance: 1/2 changes nothing, 9/10 takes
// 4 times as much).
constexpr float kShareOfLast = 0.99f, kShareOfOthers = 0.5f;

// Favours the `lobes` (bits) of lanes of the mask.
EG_INLINE void favour(Bsdf& f, Mask m, int32_t lobes, Mask last) {
    Float sum = splat(0.0f);
    Mask favoured[kLobes];
    for (int k = 0; k < kLobes; ++k) {
        favoured[k] = splat(0);
        if (!f.any_lobe[k] || !(lobes >> k & 1)) continue;
        Ggx& g = k == kMirrorLobe ? f.mirror.ggx : k == kCoatLobe ? f.coat.ggx : f.glass.ggx;
        favoured[k] = g.by_score = m & ~is_smooth(g);
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
