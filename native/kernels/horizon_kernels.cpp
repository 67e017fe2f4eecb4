// The horizon term's kernels of one instruction set. It shares parts of the picture's headers only.
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-function"
#endif
#include "boundary/terms/horizon.h"
#include "kernels/parts.h"
#include "tasks/kernel_table.h"

namespace edgegrad::EDGEGRAD_ISA {

void add_horizon_kernels(KernelTable& table) {
    table.horizon_forward = horizon_forward_kernel;
    table.horizon_backward = horizon_backward_kernel;
}

}  // namespace edgegrad::EDGEGRAD_ISA
