// The kernels of the boundaries between surfaces, of one instruction set.
#include "boundary/terms/contact_border.h"
#include "boundary/terms/indirect.h"
#include "boundary/terms/intersection.h"
#include "kernels/parts.h"
#include "tasks/boundary_kind.h"
#include "tasks/kernel_table.h"

namespace edgegrad::EDGEGRAD_ISA {

void add_indirect_kernels(KernelTable& table) {
    table.boundary[kIndirectBoundary] = {lit_segments_forward<sample_indirect>,
                                         lit_segments_backward<sample_indirect>};
    table.boundary[kContactBorder] = {lit_segments_forward<sample_border, BoundarySegment, 2>,
                                      lit_segments_backward<sample_border, BoundarySegment, 2>};
    table.boundary[kLightIntersection] = {lit_segments_forward<sample_intersection, IntersectionSegment>,
                                          lit_segments_backward<sample_intersection, IntersectionSegment>};
}

}  // namespace edgegrad::EDGEGRAD_ISA
