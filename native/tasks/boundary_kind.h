// The kinds of boundary samples: one table of their properties, over which all loops run.
#pragma once

#include <cstdint>

#include "tasks/derivative_part.h"

namespace edgegrad {

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
    kFieldOutline,           // boundary/terms/field_outline.h
    kFieldLights,            // boundary/terms/field_shadow.h: outlines of fields, seen by lights without size
    kFieldSizedLights,       // the same: tangents of fields, towards lights with a size
    kFieldEnvironment,       // the same, towards the environment
    kFieldIndirect,          // boundary/terms/field_indirect.h
    kFieldCrossing,          // boundary/terms/field_crossing.h
    kFieldBand,              // boundary/terms/relaxed_outline.h
    kWarpedPicture,          // boundary/terms/warped_picture.h, with kernels of its own
    kCrossedLight,           // boundary/terms/intersection.h: fields that pass through emissive meshes
    kCrossedSurface,         // the same: through surfaces that scatter light
    kTextureBorder,          // boundary/terms/texture_border.h
    kCameraSampledShadow,    // boundary/terms/camera_sampled_shadow.h
    kContactBorder,          // boundary/terms/contact_border.h
    kCausticOutline,         // boundary/caustics/caustic_outline.h, with kernels of its own
    kCausticEdge,            // boundary/caustics/caustic_edge.h, the same
    kBoundaryKinds
};

// Number of segments per sample: cells of directions about lines, or cells of the picture. More segments
// resolve the contribution better, fewer segments have more samples each to estimate it.
constexpr double kDirectionSegments = 0.03, kPictureSegments = 0.1;

struct BoundaryKindRow {
    BoundaryKind kind;
    Part part;             // the part that its samples estimate
    double share;          // samples per pixel and sample of the picture, at most
    double first_pass;     // fraction of the samples that the first pass takes
    int32_t least_depth;   // path segments of a sample that the camera sees directly
    BoundaryKind kernels;  // the kind whose kernels estimate it

    constexpr DerivativeTerm term() const { return kPartTable[static_cast<size_t>(part)].term; }
    // Whether paths of this depth also connect samples to the camera by further surfaces.
    constexpr bool chains(int32_t max_depth) const { return max_depth > least_depth; }
};

// native/TUNING.md explains the shares.
constexpr BoundaryKindRow kBoundaryTable[kBoundaryKinds] = {
    {kPrimaryBoundary, Part::kPrimaryEdges, 0.27, 0.18, 1, kPrimaryBoundary},
    {kShadowBoundary, Part::kLightShadows, 2.0, 0.0625, 2, kShadowBoundary},
    {kEnvironmentShadow, Part::kEnvironmentShadows, 2.0, 0.0625, 2, kShadowBoundary},
    {kIndirectBoundary, Part::kIndirectEdges, 1.5, 0.0625, 3, kIndirectBoundary},
    {kCameraSampledIndirect, Part::kCameraSampledIndirect, 1.5, 0.0625, 3, kCameraSampledIndirect},
    {kLightIntersection, Part::kLightIntersections, 0.5, 0.0625, 2, kLightIntersection},
    {kSurfaceIntersection, Part::kSurfaceIntersections, 0.5, 0.0625, 3, kLightIntersection},
    {kConeBorder, Part::kConeBorders, 0.25, 0.0625, 2, kConeBorder},
    {kLightOutline, Part::kLightOutlines, 0.1, 0.0625, 1, kLightOutline},
    {kEmitterOutline, Part::kEmitterOutlines, 1.0, 0.0625, 2, kEmitterOutline},
    {kIntersectionOutline, Part::kIntersectionOutlines, 0.1, 0.0625, 1, kIntersectionOutline},
    {kDiskIntersection, Part::kDiskIntersections, 0.5, 0.0625, 2, kDiskIntersection},
    {kFieldOutline, Part::kFieldOutlines, 0.05, 0.18, 1, kFieldOutline},
    {kFieldLights, Part::kFieldShadows, 0.25, 0.0625, 2, kFieldLights},
    {kFieldSizedLights, Part::kFieldShadows, 0.2, 0.0625, 2, kFieldSizedLights},
    {kFieldEnvironment, Part::kFieldShadows, 0.1, 0.0625, 2, kFieldSizedLights},
    {kFieldIndirect, Part::kFieldsBetween, 0.1, 0.0625, 3, kFieldIndirect},
    {kFieldCrossing, Part::kFieldCrossings, 0.1, 0.18, 1, kFieldCrossing},
    {kFieldBand, Part::kFieldBands, 0.25, 0.18, 1, kFieldBand},
    {kWarpedPicture, Part::kFieldBands, 0.25, 0.18, 1, kWarpedPicture},
    {kCrossedLight, Part::kCrossedLights, 0.5, 0.0625, 2, kLightIntersection},
    {kCrossedSurface, Part::kCrossedSurfaces, 0.5, 0.0625, 3, kLightIntersection},
    {kTextureBorder, Part::kTextureBorders, 0.27, 0.18, 1, kTextureBorder},
    {kCameraSampledShadow, Part::kCameraSampledShadows, 1.0, 0.0625, 2, kCameraSampledShadow},
    {kContactBorder, Part::kContactBorders, 1.5, 0.0625, 3, kContactBorder},
    {kCausticOutline, Part::kCausticOutlines, 0.5, 0.125, 3, kCausticOutline},
    {kCausticEdge, Part::kCausticEdges, 0.75, 0.125, 3, kCausticEdge},
};
// The part of the share of kCameraSampledShadow in scenes without sharp lobes.
constexpr double kWithoutSharpLobes = 0.25;

// Of intersections: whether the occluded surface scatters light, else it emits light; and whether the lines
// are curves on fields.
constexpr bool scatters_at_lines(int32_t kind) {
    return kind == kSurfaceIntersection || kind == kCrossedSurface;
}
constexpr bool crosses_fields(int32_t kind) { return kind == kCrossedLight || kind == kCrossedSurface; }

// Whether its segments are those of edges of meshes.
constexpr bool samples_edges(int32_t kind) {
    switch (kind) {
        case kPrimaryBoundary:
        case kShadowBoundary:
        case kEnvironmentShadow:
        case kIndirectBoundary:
        case kContactBorder:
        case kCausticEdge:
            return true;
        default:
            return false;
    }
}

constexpr bool kinds_are_in_order() {
    for (int32_t kind = 0; kind < kBoundaryKinds; ++kind)
        if (kBoundaryTable[kind].kind != kind) return false;
    return true;
}
static_assert(kinds_are_in_order());

}  // namespace edgegrad
