// Which shaders have lobes so sharp that what lights them is looked for along those.
#pragma once

#include "kernels.h"
#include "scene/tables.h"

namespace edgegrad {

// Whether a shader without textures has a lobe, not perfect, of an alpha up to `widest`; of a gloss over a
// diffuse base kWeakGloss of that.
inline bool has_sharp_lobe(const SceneTables& tables, size_t leaf, float widest) {
    if (!(tables.leaf_flags[leaf] & (kHasGlossy | kHasRefraction)) || tables.leaf_kind[leaf] == kSheen)
        return false;
    const float* row = tables.leaf_params.data() + kMaterialParams * leaf;
    const bool principled = tables.leaf_kind[leaf] == kPrincipled || tables.leaf_kind[leaf] == kDisney;
    if (principled && row[kMetallic] + row[kTransmission] < 0.5f) widest *= kWeakGloss;
    const auto sharp = [&](int place) { return row[place] > 0.0f && row[place] * row[place] <= widest; };
    return sharp(kRoughness) || (row[kCoatWeight] > 0.0f && sharp(kCoatRoughness));
}

}  // namespace edgegrad
