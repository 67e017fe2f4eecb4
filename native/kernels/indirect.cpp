// The kernels of the boundaries between surfaces, of one instruction set.
#include "boundary/indirect.h"
#include "boundary/pierced.h"
#include "kernels/parts.h"

namespace edgegrad::EDGEGRAD_ISA {

void add_indirect_kernels(KernelTable& table) {
    table.boundary[kIndirectBoundary] = {lit_segments_forward<sample_indirect>,
                                         lit_segments_backward<sample_indirect>};
    table.boundary[kPiercedLight] = {pierced_forward_kernel, pierced_backward_kernel};
    table.boundary[kPiercedSurface] = table.boundary[kPiercedLight];
}

}  // namespace edgegrad::EDGEGRAD_ISA
