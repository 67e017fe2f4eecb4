// The kinds of boundary samples, and the term of the derivative that each belongs to.
#pragma once

#include <cstdint>

namespace edgegrad {

// Kinds of boundary terms.
enum BoundaryKind : int32_t {
    kPrimaryBoundary,        // what the camera sees (boundary/terms/primary.h)
    kShadowBoundary,         // between a surface and a light (boundary/terms/shadow.h)
    kEnvironmentShadow,      // between a surface and the environment
    kIndirectBoundary,       // between two surfaces (boundary/terms/indirect.h)
    kCameraSampledIndirect,  // the same, where the camera sees it in sharp lobes
                             // (boundary/terms/camera_sampled.h)
    kLightIntersection,      // where surfaces pass through what gives light (boundary/terms/intersection.h)
    kSurfaceIntersection,    // through what scatters it
    kConeBorder,             // where spots without blend end (boundary/terms/cone_border.h)
    kLightOutline,           // of lights that the camera sees (boundary/terms/light_outline.h)
    kEmitterOutline,         // of emissive meshes that surfaces see (boundary/terms/emitter_outline.h)
    kIntersectionOutline,    // of lights that meshes pass through (boundary/terms/intersection_outline.h)
    kDiskIntersection,  // where surfaces pass through lights that face x (boundary/terms/disk_intersection.h)
    kBoundaryKinds
};
// The term that each belongs to (core/rendering/renderer.py).
constexpr const char* kBoundaryTerms[] = {"primary",  "shadow", "shadow",  "indirect", "indirect", "shadow",
                                          "indirect", "shadow", "primary", "shadow",   "primary",  "shadow"};
static_assert(sizeof kBoundaryTerms / sizeof *kBoundaryTerms == kBoundaryKinds);

}  // namespace edgegrad
