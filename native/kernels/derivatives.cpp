// The derivatives' kernels of one instruction set.
#include "boundary/shadow.h"
#include "kernels/parts.h"

namespace edgegrad::EDGEGRAD_ISA {

void add_derivative_kernels(KernelTable& table) {
    table.shadow_forward = shadow_forward_kernel;
    table.shadow_backward = shadow_backward_kernel;
}

}  // namespace edgegrad::EDGEGRAD_ISA
