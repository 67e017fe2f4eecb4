// The kernels of the boundaries between surfaces, of one instruction set.
#include "boundary/terms/indirect.h"
#include "boundary/terms/intersection.h"
#include "kernels/parts.h"

namespace edgegrad::EDGEGRAD_ISA {

void add_indirect_kernels(KernelTable& table) {
    table.boundary[kIndirectBoundary] = {lit_segments_forward<sample_indirect>,
                                         lit_segments_backward<sample_indirect>};
    table.boundary[kPiercedLight] = {lit_segments_forward<sample_pierced, PiercedSegment>,
                                     lit_segments_backward<sample_pierced, PiercedSegment>};
    table.boundary[kPiercedSurface] = table.boundary[kPiercedLight];
}

}  // namespace edgegrad::EDGEGRAD_ISA
