// The kinds of boundary samples: one table with what each is and needs, over which all loops run.
#pragma once

#include <cstdint>

namespace edgegrad {

// Terms of a derivative, in the order of core/rendering/options.py.
enum DerivativeTerm : int32_t { kInteriorTerm, kPrimaryTerm, kShadowTerm, kIndirectTerm, kDerivativeTerms };
constexpr const char* kTermNames[kDerivativeTerms] = {"interior", "primary", "shadow", "indirect"};

// The number of a kind is its tag in the seed of its samples (boundary_stream).
enum BoundaryKind : int32_t {
    kPrimaryBoundary,        // boundary/terms/primary.h
    kShadowBoundary,         // boundary/terms/shadow.h
    kEnvironmentShadow,      // the same
    kIndirectBoundary,       // boundary/terms/indirect.h
    kCameraSampledIndirect,  // boundary/terms/camera_sampled.h
    kLightIntersection,      // boundary/terms/intersection.h
    kSurfaceIntersection,    // the same
    kConeBorder,             // boundary/terms/cone_border.h
    kLightOutline,           // boundary/terms/light_outline.h
    kEmitterOutline,         // boundary/terms/emitter_outline.h
    kIntersectionOutline,    // boundary/terms/intersection_outline.h
    kDiskIntersection,       // boundary/terms/disk_intersection.h
    kBoundaryKinds
};

// What the samples of a kind are spread over.
enum BoundaryDomain : int32_t {
    kPictureLines,    // edges and intersection curves, by their length in the picture
    kLineDirections,  // edges or intersection curves, and the directions about each
    kWholePicture,    // the picture: samples start at the camera and find edges in a tree
    kLightTurns,      // curves about lights, in turns
};
// Segments by sample: cells of directions about lines, or cells of the picture. More tell better where
// samples are worth their while, fewer have more samples to tell it by.
constexpr double kDirectionSegments = 0.03, kPictureSegments = 0.1;

struct BoundaryKindRow {
    BoundaryKind kind;
    DerivativeTerm term;
    BoundaryDomain domain;
    double share;          // samples per pixel and sample of the picture, at most
    double first_pass;     // part of them that a first pass takes
    int32_t least_depth;   // path segments that a sample needs; longer paths show it by way of other surfaces
    BoundaryKind kernels;  // the kind whose kernels it has
    const char* words;

    // Whether paths of this depth show samples by way of other surfaces too.
    constexpr bool chains(int32_t max_depth) const { return max_depth > least_depth; }
};

// Reasons for the shares: native/TUNING.md.
constexpr BoundaryKindRow kBoundaryTable[kBoundaryKinds] = {
    {kPrimaryBoundary, kPrimaryTerm, kPictureLines, 0.27, 0.18, 1, kPrimaryBoundary,
     "edges that the camera sees"},
    {kShadowBoundary, kShadowTerm, kLineDirections, 2.0, 0.0625, 2, kShadowBoundary,
     "edges between a surface and a light"},
    {kEnvironmentShadow, kShadowTerm, kLineDirections, 2.0, 0.0625, 2, kShadowBoundary,
     "edges between a surface and the environment"},
    {kIndirectBoundary, kIndirectTerm, kLineDirections, 1.5, 0.0625, 3, kIndirectBoundary,
     "edges between two surfaces"},
    {kCameraSampledIndirect, kIndirectTerm, kWholePicture, 1.5, 0.0625, 3, kCameraSampledIndirect,
     "edges between two surfaces, seen in sharp lobes"},
    {kLightIntersection, kShadowTerm, kLineDirections, 0.5, 0.0625, 2, kLightIntersection,
     "curves along which surfaces pass through lights"},
    {kSurfaceIntersection, kIndirectTerm, kLineDirections, 0.5, 0.0625, 3, kLightIntersection,
     "curves along which surfaces pass through each other"},
    {kConeBorder, kShadowTerm, kLightTurns, 0.25, 0.0625, 2, kConeBorder,
     "borders of spot lights without blend"},
    {kLightOutline, kPrimaryTerm, kLightTurns, 0.1, 0.0625, 1, kLightOutline,
     "outlines of lights that the camera sees"},
    {kEmitterOutline, kShadowTerm, kWholePicture, 1.0, 0.0625, 2, kEmitterOutline,
     "outlines of emissive meshes that surfaces see"},
    {kIntersectionOutline, kPrimaryTerm, kPictureLines, 0.1, 0.0625, 1, kIntersectionOutline,
     "outlines of lights that meshes pass through"},
    {kDiskIntersection, kShadowTerm, kLineDirections, 0.5, 0.0625, 2, kDiskIntersection,
     "curves along which surfaces pass through lights that face what they light"},
};
constexpr bool kinds_are_in_order() {
    for (int32_t kind = 0; kind < kBoundaryKinds; ++kind)
        if (kBoundaryTable[kind].kind != kind) return false;
    return true;
}
static_assert(kinds_are_in_order());

}  // namespace edgegrad
