// The curves along which the surfaces of distance fields pass through meshes and through other fields, as
// lines of a scene (boundary/curves/intersections.h). The first surface of each line is the face that stands
// for a field, the second a face of a mesh or that of another field. The ends lie on the curve; samples find
// its points between them (sdf/crossing_point.h).
#pragma once

#include <cstdint>
#include <vector>

#include "boundary/curves/intersections.h"
#include "boundary/meshes/face_cut.h"
#include "sdf/carrier/carrier.h"

namespace edgegrad {

// The triangles of a carrier in the world, counterclockwise as seen from outside.
std::vector<Triangle3> placed_triangles(const FieldView& field, const FieldCarrier& carrier);

// All such curves of surfaces that are visible to rays of `seers` (bits 1 << RayKind), where one of the two
// surfaces or the camera moves. Left out are places where the surfaces are nearly parallel.
Intersections field_crossings(const EdgeList& edges, const RequestedMotion& motion, int32_t seers);

}  // namespace edgegrad
