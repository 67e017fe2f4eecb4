// The kernels of the boundaries between surfaces, of one instruction set.
#include "boundary/indirect.h"
#include "kernels/parts.h"

namespace edgegrad::EDGEGRAD_ISA {

void add_indirect_kernels(KernelTable& table) {
    table.boundary[kIndirectBoundary] = {indirect_forward_kernel, indirect_backward_kernel};
}

}  // namespace edgegrad::EDGEGRAD_ISA
