// The terms of a derivative and their parts: one table with what each is called.
#pragma once

#include <cstddef>
#include <cstdint>

namespace edgegrad {

// Terms of a derivative, in the order of core/rendering/options.py.
enum DerivativeTerm : int32_t { kInteriorTerm, kPrimaryTerm, kShadowTerm, kIndirectTerm, kDerivativeTerms };
constexpr const char* kTermNames[kDerivativeTerms] = {"interior", "primary", "shadow", "indirect"};

enum class Part : int32_t {
    kInterior,
    kRims,                   // directions at which rough glass stops to let light through
    kEdgeOn,                 // faces that the camera sees nearly edge-on
    kContact,                // light that keeps its direction where surfaces nearly touch
    kTransparency,           // what surfaces let through
    kPrimaryEdges,           // edges that the camera sees
    kUnseenMeshes,           // those of meshes that camera rays don't meet
    kSeenIntersections,      // lines where surfaces that the camera sees pass through each other
    kLightOutlines,          // outlines of lights that the camera sees
    kIntersectionOutlines,   // lights that surfaces pass through, as the camera sees them
    kFollowedLobes,          // lobes that count as mirrors for the following
    kMirroredEdges,          // edges that the camera sees by mirrors and glass
    kLightShadows,           // edges between a surface and a light
    kEnvironmentShadows,     // edges between a surface and the environment
    kEmitterOutlines,        // outlines of emissive meshes, as surfaces see them
    kLightIntersections,     // surfaces that pass through what gives light
    kDiskIntersections,      // surfaces that pass through lights that turn with what they light
    kConeBorders,            // borders of spots without blend
    kHorizons,               // horizons of faces with shading normals of their own
    kMirroredShadows,        // shadows that the camera sees by mirrors and glass
    kIndirectEdges,          // edges between two surfaces
    kCameraSampledIndirect,  // the same in sharp lobes, by samples that start at the camera
    kSurfaceIntersections,   // surfaces that pass through each other, as other surfaces see them
    kIndirectHorizons,       // horizons of faces, where these cut off light of other surfaces
    kMirroredLight,          // edges between a surface seen by mirrors and glass and others that light it
    // What is not computed (engine/decisions/missing_parts.h):
    kSelfIntersections,  // of meshes of very many faces
    kClipBorders,        // that the camera's clip distances cut
    kTexelBorders,       // of images without interpolation, on what moves
    kSlidTextures,       // the same, of textures that move over what stands still
    kBlurredOutlines,    // of disks and suns, by parallel rays through a lens
    kParallelDisks,      // disks that surfaces pass through, by parallel rays
    kPartlySeenShadows,  // of meshes that only some kinds of rays meet
    kLightJumps,         // of light on a surface that passes through what gives it
    kSteppedShadows,     // of borders that an image draws in what surfaces let through
    kRimLines,           // on rough glass, of lights without size
    kFieldOutlines,      // of distance fields, and their shadows
    kFieldLines,         // where surfaces pass through distance fields
    kFieldMirrors,       // seen by mirrors and glass, by way of distance fields
    kMirroredOutlines,   // of lights, in mirrors and behind glass
    kTotalReflection,    // borders of it, by refraction shaders
    kLongChains,         // of mirrors
    kCaustics,
    kParts
};

struct PartRow {
    Part part;
    const char* name;  // as core/planning/ knows it
    DerivativeTerm term;
};
constexpr size_t kPartCount = static_cast<size_t>(Part::kParts);
constexpr PartRow kPartTable[kPartCount] = {
    {Part::kInterior, "shading", kInteriorTerm},
    {Part::kRims, "rims", kInteriorTerm},
    {Part::kEdgeOn, "edge-on faces", kInteriorTerm},
    {Part::kContact, "contact", kInteriorTerm},
    {Part::kTransparency, "transparency", kInteriorTerm},
    {Part::kPrimaryEdges, "edges", kPrimaryTerm},
    {Part::kUnseenMeshes, "unseen meshes", kPrimaryTerm},
    {Part::kSeenIntersections, "seen intersections", kPrimaryTerm},
    {Part::kLightOutlines, "light outlines", kPrimaryTerm},
    {Part::kIntersectionOutlines, "intersection outlines", kPrimaryTerm},
    {Part::kFollowedLobes, "followed lobes", kPrimaryTerm},
    {Part::kMirroredEdges, "mirrored edges", kPrimaryTerm},
    {Part::kLightShadows, "light shadows", kShadowTerm},
    {Part::kEnvironmentShadows, "environment shadows", kShadowTerm},
    {Part::kEmitterOutlines, "emitter outlines", kShadowTerm},
    {Part::kLightIntersections, "light intersections", kShadowTerm},
    {Part::kDiskIntersections, "disk intersections", kShadowTerm},
    {Part::kConeBorders, "cone borders", kShadowTerm},
    {Part::kHorizons, "horizons", kShadowTerm},
    {Part::kMirroredShadows, "mirrored shadows", kShadowTerm},
    {Part::kIndirectEdges, "edges between surfaces", kIndirectTerm},
    {Part::kCameraSampledIndirect, "camera-sampled edges", kIndirectTerm},
    {Part::kSurfaceIntersections, "surface intersections", kIndirectTerm},
    {Part::kIndirectHorizons, "indirect horizons", kIndirectTerm},
    {Part::kMirroredLight, "mirrored light", kIndirectTerm},
    {Part::kSelfIntersections, "self intersections", kPrimaryTerm},
    {Part::kClipBorders, "clip borders", kPrimaryTerm},
    {Part::kTexelBorders, "texel borders", kPrimaryTerm},
    {Part::kSlidTextures, "slid textures", kPrimaryTerm},
    {Part::kBlurredOutlines, "blurred outlines", kPrimaryTerm},
    {Part::kParallelDisks, "parallel disks", kPrimaryTerm},
    {Part::kPartlySeenShadows, "partly seen shadows", kShadowTerm},
    {Part::kLightJumps, "light jumps", kShadowTerm},
    {Part::kSteppedShadows, "stepped shadows", kShadowTerm},
    {Part::kRimLines, "rim lines", kInteriorTerm},
    {Part::kFieldOutlines, "field outlines", kPrimaryTerm},
    {Part::kFieldLines, "field lines", kPrimaryTerm},
    {Part::kFieldMirrors, "field mirrors", kPrimaryTerm},
    {Part::kMirroredOutlines, "mirrored outlines", kPrimaryTerm},
    {Part::kTotalReflection, "total reflection", kPrimaryTerm},
    {Part::kLongChains, "long chains", kPrimaryTerm},
    {Part::kCaustics, "caustics", kInteriorTerm},
};
constexpr bool parts_are_in_order() {
    for (size_t k = 0; k < kPartCount; ++k)
        if (kPartTable[k].part != static_cast<Part>(k)) return false;
    return true;
}
static_assert(parts_are_in_order());

}  // namespace edgegrad
