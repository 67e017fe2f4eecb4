// Embree's callbacks for the bricks of fields, single rays and packets alike (sdf/trace.cpp).
#pragma once

#include "embree/api.h"

namespace edgegrad::EDGEGRAD_ISA {

// The context of queries of scenes with fields. Embree does not call a query's filter for hits that a user
// function finds.
struct BrickContext {
    embree::QueryContext base;        // first: Embree passes its address to the callbacks
    embree::Filter filter = nullptr;  // of any hit; null: all hits count
};

// A hit stores its place in the box in the bits of Embree's u and v, since a field has no barycentrics: 21
// bits along each axis. sdf/tangent_plane.h reads them. Selecting, storing and loading floats keeps their
// bits; arithmetic would not.
void intersect_brick(const embree::UserArguments* args);
void occlude_brick(const embree::UserArguments* args);

}  // namespace edgegrad::EDGEGRAD_ISA
