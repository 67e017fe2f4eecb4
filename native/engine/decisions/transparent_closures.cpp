#include "engine/decisions/transparent_closures.h"

#include <algorithm>

#include "engine/decisions/value_sources.h"
#include "tasks/records/transparent_surfaces.h"

namespace edgegrad {
namespace {

// The columns of a closure's row that determine how much light it transmits straight on.
uint64_t transparency_columns(const SceneView& scene, size_t closure) {
    const bool clear = scene.closure_kind[closure] == kTransparent;
    return Requested::columns(kWeight, kWeight + 1) |
           (clear ? Requested::columns(kBaseColor, kBaseColor + 3) : Requested::columns(kAlpha, kAlpha + 1));
}

}  // namespace

std::vector<int32_t> transparent_closures(const SceneView& scene, const SceneTables& tables,
                                          const Requested& requested, bool geometry) {
    if (!(scene.all_flags & kHasTransparency)) return {};
    std::vector<int32_t> out(tables.closure_flags.size(), 0);
    for (size_t closure = 0; closure < out.size(); ++closure) {
        if (!(tables.closure_flags[closure] & kHasTransparency)) continue;
        const ValueSources sources =
            value_sources(scene, requested, closure, transparency_columns(scene, closure));
        out[closure] = sources.requested              ? kShareChanges | kEndsChange
                       : geometry && sources.programs ? kShareChanges
                                                      : 0;
    }
    if (std::all_of(out.begin(), out.end(), [](int32_t bits) { return bits == 0; })) return {};
    return out;
}

}  // namespace edgegrad
