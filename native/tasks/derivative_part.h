// The terms of a derivative and their parts: one table of their names.
#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>

namespace edgegrad {

// Terms of a derivative, in the order of core/rendering/options.py.
enum DerivativeTerm : int32_t { kInteriorTerm, kPrimaryTerm, kShadowTerm, kIndirectTerm, kDerivativeTerms };
constexpr const char* kTermNames[kDerivativeTerms] = {"interior", "primary", "shadow", "indirect"};

enum class Part : int32_t {
    kInterior,
    kRims,                   // directions beyond which lobes scatter no light
    kFavouredLobes,          // lobes of which only the roughness is requested
    kEdgeOn,                 // faces that the camera sees nearly edge-on
    kContact,                // light of a fixed direction where surfaces nearly touch
    kSharpReflections,       // light that narrow lobes throw on other surfaces
    kTransparency,           // transmittance of surfaces
    kPrimaryEdges,           // edges that the camera sees
    kUnseenMeshes,           // edges of meshes that camera rays cannot hit
    kSeenIntersections,      // lines where surfaces that the camera sees pass through each other
    kLightOutlines,          // outlines of lights that the camera sees
    kIntersectionOutlines,   // lights that surfaces pass through, as the camera sees them
    kFieldOutlines,          // outlines of distance fields that the camera sees
    kFieldBands,             // the same, from bands about them
    kFieldCrossings,         // lines where distance fields that the camera sees pass through surfaces
    kTextureBorders,         // borders within faces at which textures jump, as the camera sees them
    kFollowedLobes,          // lobes that count as mirrors in the next part
    kMirroredEdges,          // edges that the camera sees by mirrors and glass
    kMirroredOutlines,       // outlines of lights that the camera sees by mirrors and glass
    kLightShadows,           // edges between a surface and a light
    kEnvironmentShadows,     // edges between a surface and the environment
    kCameraSampledShadows,   // shadows in sharp lobes, by samples that start at the camera
    kEmitterOutlines,        // outlines of emissive meshes, as surfaces see them
    kLightIntersections,     // surfaces that pass through light sources
    kDiskIntersections,      // surfaces that pass through lights that face their receiver
    kConeBorders,            // borders of spots without blend
    kHorizons,               // horizons of faces with shading normals of their own
    kFieldShadows,           // distance fields between a surface and a light or the environment
    kCrossedLights,          // distance fields that pass through emissive meshes
    kMirroredShadows,        // shadows that the camera sees by mirrors and glass
    kIndirectEdges,          // edges between two surfaces
    kCameraSampledIndirect,  // the same in sharp lobes, by samples that start at the camera
    kContactBorders,         // borders of faces near contact, over which light of a fixed direction moves
    kSurfaceIntersections,   // surfaces that pass through each other, as other surfaces see them
    kFieldsBetween,          // distance fields between two surfaces
    kCrossedSurfaces,        // distance fields that pass through surfaces, as other surfaces see them
    kIndirectHorizons,       // horizons of faces that cut off light of other surfaces
    kCausticOutlines,        // outlines of lights in light that mirrors and glass throw on other surfaces
    kCausticEdges,           // edges in such light
    kMirroredLight,          // edges between a surface seen by mirrors and glass and others that light it
    // Parts that are not computed (engine/decisions/missing/missing_parts.h):
    kSelfIntersections,  // of meshes of very many faces
    kCoincidentFaces,    // faces of two meshes, or a light and a face, in one plane
    kPartingMeshes,      // two meshes touch along edges or faces, and one of them moves
    kWideLens,           // edges seen through a lens far wider than its distance of focus
    kClipBorders,        // borders that the camera's clip distances cut
    kDiscBorder,         // border of the disc that a fisheye sees
    kBeyondPoles,        // edges in the part of an equirectangular picture beyond a pole
    kTexelBorders,       // those of the borders of kTextureBorders that are not sampled
    kRayHistories,       // textures that read bounces and lengths of rays
    kSlidTextures,       // borders at which textures jump, where they move over static surfaces
    kBlurredOutlines,    // outlines of disks and suns, seen by parallel rays through a lens
    kParallelDisks,      // disks that surfaces pass through, seen by parallel rays
    kParallelMirrors,    // flat mirrors in which parallel rays show all of a sun or none
    kPartlySeenShadows,  // shadows of meshes that only some kinds of rays can hit
    kLightJumps,         // jumps of light on a surface that passes through its source
    kFaceFlips,          // faces of smooth meshes that lights without size begin or cease to reach
    kLitFromBelow,       // shadows where lights below the planes of faces light smooth meshes
    kSteppedShadows,     // shadows of borders at which a surface's transmittance jumps
    kClearAbsorption,    // absorption in meshes whose surface is transparent
    kMedia,              // light in media, where anything moves
    kFurtherShadows,     // shadows that paths with both perfect and other bounces find, of some lights
    kRimLines,           // the same for lights without size
    kFieldBorders,       // lines where distance fields end at their boxes
    kThinFields,         // parts of distance fields that are thinner than a cell
    kNarrowFieldLobes,   // what distance fields hide of narrow lobes
    kFieldLines,         // lights that pass through distance fields
    kMirroredLines,      // lights that surfaces pass through, in mirrors and behind glass
    kTurnedNormals,      // gloss whose normals turn away from the viewer, below the surface
    kTotalReflection,    // borders of total reflection of Refraction closures
    kLongChains,         // chains of too many mirrors
    kCaustics,
    kParts
};

struct PartRow {
    Part part;
    const char* name;  // as core/planning/ knows it
    DerivativeTerm term;
};
constexpr size_t kPartCount = static_cast<size_t>(Part::kParts);
using PartSet = std::bitset<kPartCount>;
constexpr PartRow kPartTable[kPartCount] = {
    {Part::kInterior, "shading", kInteriorTerm},
    {Part::kRims, "rims", kInteriorTerm},
    {Part::kFavouredLobes, "favoured lobes", kInteriorTerm},
    {Part::kEdgeOn, "edge-on faces", kInteriorTerm},
    {Part::kContact, "contact", kInteriorTerm},
    {Part::kSharpReflections, "sharp reflections", kInteriorTerm},
    {Part::kTransparency, "transparency", kInteriorTerm},
    {Part::kPrimaryEdges, "edges", kPrimaryTerm},
    {Part::kUnseenMeshes, "unseen meshes", kPrimaryTerm},
    {Part::kSeenIntersections, "seen intersections", kPrimaryTerm},
    {Part::kLightOutlines, "light outlines", kPrimaryTerm},
    {Part::kIntersectionOutlines, "intersection outlines", kPrimaryTerm},
    {Part::kFieldOutlines, "field outlines", kPrimaryTerm},
    {Part::kFieldBands, "field bands", kPrimaryTerm},
    {Part::kFieldCrossings, "field crossings", kPrimaryTerm},
    {Part::kTextureBorders, "texture borders", kPrimaryTerm},
    {Part::kFollowedLobes, "followed lobes", kPrimaryTerm},
    {Part::kMirroredEdges, "mirrored edges", kPrimaryTerm},
    {Part::kMirroredOutlines, "mirrored outlines", kPrimaryTerm},
    {Part::kLightShadows, "light shadows", kShadowTerm},
    {Part::kEnvironmentShadows, "environment shadows", kShadowTerm},
    {Part::kCameraSampledShadows, "camera-sampled shadows", kShadowTerm},
    {Part::kEmitterOutlines, "emitter outlines", kShadowTerm},
    {Part::kLightIntersections, "light intersections", kShadowTerm},
    {Part::kDiskIntersections, "disk intersections", kShadowTerm},
    {Part::kConeBorders, "cone borders", kShadowTerm},
    {Part::kHorizons, "horizons", kShadowTerm},
    {Part::kFieldShadows, "field shadows", kShadowTerm},
    {Part::kCrossedLights, "crossed lights", kShadowTerm},
    {Part::kMirroredShadows, "mirrored shadows", kShadowTerm},
    {Part::kIndirectEdges, "edges between surfaces", kIndirectTerm},
    {Part::kCameraSampledIndirect, "camera-sampled edges", kIndirectTerm},
    {Part::kContactBorders, "contact borders", kIndirectTerm},
    {Part::kSurfaceIntersections, "surface intersections", kIndirectTerm},
    {Part::kFieldsBetween, "fields between surfaces", kIndirectTerm},
    {Part::kCrossedSurfaces, "crossed surfaces", kIndirectTerm},
    {Part::kIndirectHorizons, "indirect horizons", kIndirectTerm},
    {Part::kCausticOutlines, "caustic outlines", kIndirectTerm},
    {Part::kCausticEdges, "caustic edges", kIndirectTerm},
    {Part::kMirroredLight, "mirrored light", kIndirectTerm},
    {Part::kSelfIntersections, "self intersections", kPrimaryTerm},
    {Part::kCoincidentFaces, "coincident faces", kPrimaryTerm},
    {Part::kPartingMeshes, "parting meshes", kPrimaryTerm},
    {Part::kWideLens, "wide lens", kPrimaryTerm},
    {Part::kClipBorders, "clip borders", kPrimaryTerm},
    {Part::kDiscBorder, "disc border", kPrimaryTerm},
    {Part::kBeyondPoles, "beyond poles", kPrimaryTerm},
    {Part::kTexelBorders, "texel borders", kPrimaryTerm},
    {Part::kRayHistories, "ray histories", kPrimaryTerm},
    {Part::kSlidTextures, "slid textures", kPrimaryTerm},
    {Part::kBlurredOutlines, "blurred outlines", kPrimaryTerm},
    {Part::kParallelDisks, "parallel disks", kPrimaryTerm},
    {Part::kParallelMirrors, "parallel mirrors", kPrimaryTerm},
    {Part::kPartlySeenShadows, "partly seen shadows", kShadowTerm},
    {Part::kLightJumps, "light jumps", kShadowTerm},
    {Part::kFaceFlips, "face flips", kShadowTerm},
    {Part::kLitFromBelow, "lit from below", kShadowTerm},
    {Part::kSteppedShadows, "stepped shadows", kShadowTerm},
    {Part::kClearAbsorption, "clear absorption", kInteriorTerm},
    {Part::kMedia, "media", kInteriorTerm},
    {Part::kFurtherShadows, "further shadows", kShadowTerm},
    {Part::kRimLines, "rim lines", kInteriorTerm},
    {Part::kFieldBorders, "field borders", kPrimaryTerm},
    {Part::kThinFields, "thin fields", kPrimaryTerm},
    {Part::kNarrowFieldLobes, "narrow field lobes", kShadowTerm},
    {Part::kFieldLines, "field lines", kPrimaryTerm},
    {Part::kMirroredLines, "mirrored lines", kPrimaryTerm},
    {Part::kTurnedNormals, "turned normals", kPrimaryTerm},
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
